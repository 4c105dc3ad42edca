"""Figures of a run by the clock, and the processes and the description that it starts with."""

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from flexarm_bringup.processes.late_cycles import LateCycles
from flexarm_bringup.processes.standstill import Standstill, Witnesses
from flexarm_bringup.realtime.answered import AnsweredPeriods
from flexarm_bringup.realtime.command import add_arguments, chosen_settings, to_and_fro, write_manipulator
from flexarm_bringup.realtime.figures import Counts, Figures
from flexarm_model.reading.config import load_config

GOOD = Counts(1000, 9, 998, 9, 2)


def late(*told):
    cycles = LateCycles()
    for now, count in told:
        cycles.note(now, count)
    return cycles


def figures(counts=GOOD, stop="", cycles=None, witnesses=None):
    steps, cycles = [1e-4, 2e-4, 3e-4], cycles or late()
    return Figures(10.0, 5.0, counts, {"mpc": counts.answers}, steps, cycles, stop, witnesses)


def missed(found):
    return [check.name for check in found.checks() if not check.passed]


def test_counts_are_of_the_time_that_was_watched():
    assert Counts(50, 2, 40, 1, 9).since(Counts(20, 2, 15, 0, 9)) == Counts(30, 0, 25, 1, 0)


def test_just_under_one_percent_is_kept_and_one_percent_is_not():
    assert not missed(figures())
    assert missed(figures(Counts(1000, 10, 998, 9, 2))) == ["ticks without a fresh command"]
    assert missed(figures(Counts(1000, 9, 900, 9, 100))) == ["controller overruns"]


def test_periods_between_two_statuses_are_answered_unless_they_were_missed_or_nobody_spoke():
    """At 500 Hz every third answer is told; 20 ms of silence are three periods and seven nobody knows of."""
    answered = AnsweredPeriods(0.002)
    for stamp_ms, missed, total in [
        (1000, 7, 0), (1006, 7, 3), (1012, 8, 5), (1014, 8, 6), (1034, 8, 9), (1054, 18, 9), (1050, 18, 9),
    ]:  # fmt: skip
        answered.note(stamp_ms * 1_000_000, missed)
        assert answered.total == total


def test_at_200_hz_every_answer_is_told():
    answered = AnsweredPeriods(0.005)
    for k, total in [(0, 0), (1, 1), (2, 2), (5, 3)]:
        answered.note(k * 5_000_000, 0)
        assert answered.total == total


def test_one_late_guard_cycle_is_one_too_many():
    assert missed(figures(cycles=late((0.0, 4), (1.0, 5)))) == ["guard cycles that were late"]


def test_cycles_that_were_late_before_the_watch_do_not_count():
    cycles = late((0.0, 4), (1.0, 5))
    cycles.begin()
    cycles.note(2.0, 5)
    assert cycles.total == 0 and not missed(figures(cycles=cycles))


def test_a_late_cycle_is_the_machines_only_when_a_core_stood_still_just_before_it_was_told():
    cycles = late((10.0, 0), (10.1, 0), (10.2, 2), (10.3, 2), (10.4, 2), (10.5, 3))
    assert cycles.during([Standstill(10.12, 10.13)]) == 2
    assert cycles.during([Standstill(10.45, 10.46)]) == 1
    assert cycles.during([Standstill(10.12, 10.13), Standstill(10.45, 10.46)]) == cycles.total == 3
    assert cycles.during([Standstill(10.21, 10.23)]) == 0
    witnesses = Witnesses()
    witnesses.standstills = [Standstill(10.12, 10.13)]
    own = {check.name: check.found for check in figures(cycles=cycles, witnesses=witnesses).checks()}
    assert own["of these, while the machine itself ran"] == "1"
    witnesses.are_heard = False
    assert len(figures(cycles=cycles, witnesses=witnesses).checks()) == len(figures().checks())


def test_witnesses_see_a_core_that_is_kept_from_them():
    """A thread of higher priority holds the only core for 30 ms."""
    code = (
        "import os, time\n"
        "os.sched_setaffinity(0, {CORE})\n"
        "os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(95))\n"
        "end = time.monotonic() + 0.03\n"
        "while time.monotonic() < end: pass\n"
    ).replace("CORE", str(min(os.sched_getaffinity(0))))
    with Witnesses() as witnesses:
        time.sleep(0.5)
        hog = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True)
        time.sleep(0.1)
    if hog.returncode or not witnesses.are_heard:
        pytest.skip("needs the right to raise priorities")
    assert max(each.seconds for each in witnesses.standstills) > 0.025


def test_what_witnesses_saw_is_told_where_they_could_watch():
    witnesses = Witnesses()
    assert not witnesses.seen
    witnesses.standstills = [Standstill(10.0, 10.004), Standstill(11.0, 11.05)]
    assert witnesses.seen == "the machine itself stood still: 2 times, for 50 ms at most"
    witnesses.are_heard = False
    assert not witnesses.seen


def test_standstills_before_and_after_the_watch_are_not_told_as_its_own():
    witnesses = Witnesses()
    start_up, end = [Standstill(2.0, 2.5), Standstill(9.0, 9.99)], [Standstill(15.1, 15.4)]
    witnesses.standstills = [*start_up, Standstill(9.998, 10.001), Standstill(12.0, 12.004), *end]
    told = dict(figures(witnesses=witnesses).rows())
    assert told["standstills of a core of more than 2 ms"] == 2
    assert told["longest standstill of a core [ms]"] == pytest.approx(4.0)


def test_cycles_that_nobody_told_of_and_a_stop_are_missed_bounds():
    assert missed(figures(Counts(1000, 0, 980, 0, 0))) == ["guard cycles answered or told as missed"]
    assert missed(figures(stop="no command for 50 ms")) == ["the arm was not stopped"]


def test_nothing_counted_is_not_a_success():
    assert missed(figures(Counts()))


def test_another_rate_changes_the_description_in_nothing_else(tmp_path):
    path = write_manipulator(tmp_path, 500.0)
    fast, own = load_config(path, "geared"), load_config(write_manipulator(tmp_path, 0.0), "geared")
    assert (fast.rate_hz, own.rate_hz) == (500.0, 200.0)
    assert fast.config_id != own.config_id
    assert fast.actuated == own.actuated and fast.modes == own.modes


def test_the_reference_fills_the_time_and_comes_back():
    reference = to_and_fro(20.0)
    assert reference.t[-1] > 17.0  # the last move of a slot ends before its wait is over
    assert abs(reference.theta.max() - 0.5236) < 1e-9
    assert abs(reference.theta[-1, 0]) < 1e-9


@pytest.mark.parametrize(
    ("asked", "delay", "period", "is_tuned"),
    [("", 2, 0.005, True), ("--delay 1", 1, 0.005, True), ("--rate 500", 2, 0.002, False)],
)
def test_the_nodes_get_what_was_chosen_for_the_arm_at_its_own_rate(
    asked: str, delay: int, period: float, is_tuned: bool
) -> None:
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    settings = chosen_settings(parser.parse_args(asked.split()))
    assert settings["controller"]["delay_periods"] == delay
    assert settings["controller"]["period"] == pytest.approx(period)
    assert ("stiffness_modes" in settings.get("estimator", {})) == is_tuned
    assert ("input_jerk" in settings["controller"]) == is_tuned


def test_a_witness_does_not_outlive_who_started_it():
    code = (
        "import os, subprocess, sys\n"
        "command = [sys.executable, '-m', 'flexarm_bringup.processes.standstill', '0', str(os.getpid())]\n"
        "child = subprocess.Popen(command)\n"
        "print(child.pid)"
    )
    told = subprocess.run(
        [sys.executable, "-c", code], check=True, capture_output=True, text=True, timeout=120
    )
    witness, end = Path(f"/proc/{told.stdout.strip()}"), time.monotonic() + 60.0
    while witness.exists() and time.monotonic() < end:
        time.sleep(0.05)
    assert not witness.exists()


@pytest.mark.parametrize(
    "wrong",
    [["--law", "abc"], ["--delay", "0"], ["--rate", "-1"], ["--minutes", "nan"], ["--minutes", "0.01"]],
)
def test_a_wrong_option_is_refused_before_any_node_is_started(wrong, capsys):
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    with pytest.raises(SystemExit) as stop:
        parser.parse_args(wrong)
    assert stop.value.code == 2
    assert wrong[0] in capsys.readouterr().err
