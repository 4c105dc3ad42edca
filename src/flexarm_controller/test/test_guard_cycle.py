"""When the guard answers, and what counts as late."""

import random

import pytest

from flexarm_controller.guard_cycle import GuardCycle

T = 0.005


def cycle():
    return GuardCycle(T, 0.8)


def run(made, start, periods, jitter=lambda: 0.0, took=lambda: 0.002):
    for k in range(periods):
        now = start + k * T + jitter()
        made.begin(now)
        made.end(now + took())
    return start + periods * T


def test_a_command_may_take_its_share_of_the_period():
    made = cycle()
    made.begin(10.0)
    assert made.wait(10.0) == pytest.approx(0.8 * T)
    assert made.wait(10.003) == pytest.approx(0.001)
    assert made.wait(10.1) == 0.0


@pytest.mark.parametrize(("period", "most"), [(0.005, 0.004), (0.002, 0.0013), (0.001, 0.0005)])
def test_of_a_short_period_the_answer_keeps_the_time_that_it_needs(period, most):
    made = GuardCycle(period, 0.8, 0.0007)
    made.begin(10.0)
    assert made.wait(10.0) == pytest.approx(most)


def test_a_state_that_came_late_leaves_its_command_less_time():
    made = cycle()
    now = run(made, 10.0, 200)
    made.begin(now + 0.002)
    assert made.wait(now + 0.002) == pytest.approx(0.8 * T - 0.002, abs=2e-4)  # of the creep


def test_after_an_answer_it_waits_for_the_command_of_the_next_period_and_then_by_periods():
    made = cycle()
    made.begin(10.0)
    made.end(10.002)
    assert made.wait(10.002) == pytest.approx(1.8 * T - 0.002)
    assert made.wait(10.02) == T  # the drives say nothing
    assert cycle().wait(3.0) == T


def test_answers_in_time_are_not_late_whatever_the_jitter():
    rng, made = random.Random(1), cycle()
    run(made, 10.0, 5000, lambda: abs(rng.gauss(0.0, 3e-4)), lambda: rng.uniform(0.0005, 0.004))
    assert made.late == 0


def test_every_answer_after_its_period_is_late_and_so_is_one_that_never_came():
    made = cycle()
    now = run(made, 10.0, 100)
    now = run(made, now, 7, took=lambda: 1.1 * T)
    assert made.late == 7
    made.begin(now)  # never answered
    made.begin(now + T)
    made.end(now + T + 0.001)
    assert made.late == 8
    made.begin(now + 4 * T, periods=3)  # two states were overwritten
    made.end(now + 4 * T + 0.001)
    assert made.late == 10


def test_a_clock_of_the_drives_that_runs_slower_is_followed():
    made = cycle()
    for k in range(2000):
        now = 10.0 + k * T * 1.0001
        made.begin(now)
        made.end(now + 0.9 * T)
    assert made.late == 0


def test_drives_that_come_back_after_a_long_silence_begin_anew():
    made = cycle()
    run(made, 10.0, 100)
    run(made, 20.0, 100)
    assert made.late == 0


def test_it_tells_how_long_nobody_looked():
    made = cycle()
    assert made.look(5.0) == 0.0
    assert made.look(5.01) == pytest.approx(0.01)
    assert made.look(6.01) == pytest.approx(1.0)


def test_drives_that_said_nothing_yet_or_not_for_too_long_are_silent():
    made = GuardCycle(T, 0.8, longest_silence=0.035)
    assert made.silence(1e9) == "drives silent for 35 ms"
    made.begin(10.0)
    assert (made.silence(10.034), made.silence(10.036)) == ("", "drives silent for 35 ms")
    assert cycle().silence(1e9) == ""


def test_it_looks_again_for_an_answer_or_when_the_drives_have_been_silent_for_too_long():
    made = GuardCycle(T, 0.8, longest_silence=0.035)
    assert made.next_look(3.0) == 3.0 + T
    made.begin(10.0)
    assert made.next_look(10.0) == pytest.approx(10.0 + 0.8 * T)
    made.end(10.002)
    assert made.next_look(10.033) == pytest.approx(10.035)
    assert made.next_look(10.04) == pytest.approx(10.04 + T)
