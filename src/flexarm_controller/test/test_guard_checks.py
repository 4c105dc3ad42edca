"""Strain, energy and model: what else stops an arm or keeps a command from it."""

import math
from dataclasses import replace

import pytest
from guarded_arm import LIMITS, REST, TOKEN, armed, command, stand

from flexarm_controller.guard import ARMED, BRAKING, Guard, GuardState, JointRange
from flexarm_controller.guarding.axis_label import AxisLabel
from flexarm_controller.guarding.checks import too_much_energy
from flexarm_controller.guarding.energy import EnergyWindow

STRAINS = (1e-3, 5e-4)


def strained(*strain):
    guard = armed(strain=STRAINS)
    guard.step(command(0.0), GuardState((1.0, 0.0), (0.0, 0.0), strain), 0.0)
    return guard


@pytest.mark.parametrize(
    ("strain", "why"),
    [
        ((1.1e-3, 0.0), "gauge 1 is strained beyond its limit: 1100 of 1000 ustrain"),
        ((0.0, -6e-4), "gauge 2 is strained beyond its limit: -600 of 500 ustrain"),
        ((math.nan, math.inf), "gauge 2 is strained beyond its limit: inf of 500 ustrain"),
        ((0.0,), "1 strains, the arm has 2 gauges with a limit"),
        ((0.0, 0.0, 0.0), "3 strains, the arm has 2 gauges with a limit"),
    ],
)
def test_a_strain_beyond_its_limit_latches_a_stop_and_names_the_gauge(strain, why):
    guard = strained(*strain)
    assert (guard.mode, guard.reason, guard.refused) == (BRAKING, why, 1)


def test_a_gauge_whose_name_is_known_is_called_by_it():
    guard = armed(strain=STRAINS, gauges=("root_strain", "tip_strain"))
    guard.step(command(0.0), GuardState((1.0, 0.0), (0.0, 0.0), (0.0, 7e-4)), 0.0)
    assert guard.reason == "gauge 2 (tip_strain) is strained beyond its limit: 700 of 500 ustrain"


@pytest.mark.parametrize("strain", [(), (1e-3, -5e-4), (math.nan, math.nan), (math.nan, 1e-4)])
def test_strain_up_to_its_limit_and_silent_gauges_are_no_reason_to_stop(strain):
    assert strained(*strain).mode == ARMED


FAST = (2.0, math.inf)  # the second axis may be as fast as it likes


@pytest.mark.parametrize(
    ("velocity", "why"),
    [
        ((2.01, 0.0), "axis 1 is faster than it may be: 2.01 of 2"),
        ((-3.0, 9.0), "axis 1 is faster than it may be: -3 of 2"),
        ((math.nan, 0.0), "axis 1 is faster than it may be: nan of 2"),
        ((1.0,), "drives do not tell the velocity of every axis"),
        ((), "drives do not tell the velocity of every axis"),
    ],
)
def test_an_axis_that_is_faster_than_it_may_be_stops_the_arm_in_the_middle_of_its_range(velocity, why):
    guard = armed(velocity=FAST)
    guard.step(command(0.0), GuardState(velocity, (0.0, 0.0)), 0.0)
    assert (guard.mode, guard.reason) == (BRAKING, why)


@pytest.mark.parametrize("velocity", [(2.0, 0.0), (-2.0, 1e6), (0.0, math.inf), (0.0, math.nan)])
def test_an_axis_up_to_its_velocity_limit_and_one_without_are_no_reason_to_stop(velocity):
    guard = armed(velocity=FAST)
    guard.step(command(0.0), GuardState(velocity, (0.0, 0.0)), 0.0)
    assert guard.mode == ARMED


@pytest.mark.parametrize("energy", [-3.0, 0.0, 2.0])
def test_the_energy_of_the_window_is_the_sum_of_torque_times_velocity(energy):
    """E = tau v t at constant power, and nothing more once it has lasted for the window."""
    window = EnergyWindow(0.25, 0.005)
    for k in range(1, 101):
        told = window.add((2.0, 1.0), (energy / 4.0, energy / 2.0))
        assert told == window.energy == pytest.approx(energy * min(k, 50) * 0.005, abs=1e-12)
    for _ in range(50):
        window.add((2.0, 1.0), (0.0, 0.0))
    assert window.energy == 0.0


def test_a_velocity_that_cannot_be_true_adds_no_energy():
    window = EnergyWindow(0.25, 0.005)
    assert window.add((1.0, 2.0), (math.nan, 1.0)) == pytest.approx(0.01)
    assert window.add((1.0, 2.0), (math.inf, 1.0)) == pytest.approx(0.02)
    assert window.add((1.0, 2.0), ()) == pytest.approx(0.02)


def test_a_window_shorter_than_a_period_is_one_period():
    window = EnergyWindow(1e-4, 0.005)
    window.add((1.0,), (1.0,))
    assert window.add((2.0,), (1.0,)) == pytest.approx(0.01)


def driven(energy, periods, sign=1.0):
    """Return a guard whose motors put 0.3 * 10 + 0.1 * 20 = 5 W into an arm, and what it said."""
    guard = armed(energy=energy)
    for k in range(periods):
        guard.step(command(k * 0.005, k), GuardState((sign * 10.0, sign * 20.0), (0.0, 0.0)), k * 0.005)
    return guard


def test_motors_that_put_in_more_energy_than_the_arm_can_take_latch_a_stop():
    limit = 1.0 + 1e-9  # a sum of floats is rounded, on some Pythons more than on others
    guard = driven(limit, 41)  # the first period has no torque yet
    assert guard.mode == ARMED and guard.energy == pytest.approx(1.0)
    guard = driven(limit, 42)
    assert guard.mode == BRAKING and guard.energy == pytest.approx(1.025)
    assert guard.reason == "motors have put 1.03 of 1 J into the arm within 250 ms"


def test_energy_that_is_taken_out_or_older_than_the_window_is_no_reason_to_stop():
    assert driven(1.0, 100, -1.0).mode == ARMED
    guard = driven(1.3, 300)
    assert guard.mode == ARMED and guard.energy == pytest.approx(1.25)


def test_energy_up_to_its_limit_may_be_put_in():
    limits = replace(LIMITS, energy=1.0)
    assert too_much_energy(1.0, limits) == "" != too_much_energy(math.nextafter(1.0, 2.0), limits)


def test_energy_that_is_not_a_number_latches_a_stop():
    guard = armed(energy=1.0)
    for k, v in enumerate((0.0, 1.7e308, -1.7e308)):
        guard.step(command(k * 0.005, k, (9.0, 9.0)), GuardState((v, v), (0.0, 0.0)), k * 0.005)
    assert guard.mode == BRAKING


def test_without_a_limit_any_energy_may_be_put_in():
    assert LIMITS.energy == math.inf and driven(LIMITS.energy, 60).mode == ARMED


def test_a_command_computed_with_another_model_is_refused_by_name():
    guard = armed()
    guard.serve("new", 0.0)
    assert guard.model_id == "new"
    guard.step(command(0.0, 1, model_id="other"), REST, 0.0)
    assert guard.refusal == "command computed with model 'other', served is 'new'"
    guard.step(command(0.001, 1), REST, 0.001)
    assert (guard.passed, guard.refused, guard.mode) == (0, 2, ARMED)
    guard.step(command(0.002, 2, model_id="new"), REST, 0.002)
    assert guard.passed == 1


def test_time_that_goes_back_or_is_none_stops_the_arm():
    """It would be armed for as long as time had gone back, and hear of no silence."""
    for t, told in ((-50.0, "-50"), (0.9, "0.9"), (math.nan, "nan")):
        guard = armed()
        assert guard.step(command(1.0, 1), REST, 1.0) and guard.mode == ARMED
        guard.step(None, REST, 1.0)
        assert guard.mode == ARMED  # asked twice for the same instant
        guard.step(None, REST, t)
        assert guard.mode != ARMED and guard.reason == f"time went from 1 to {told} s"


def test_a_guard_that_is_armed_again_goes_on_with_another_clock():
    """A simulated rig that is started anew begins at zero."""
    guard = armed()
    guard.step(command(100.0, 1), REST, 100.0)
    guard.stop("button")
    for k in range(60):
        guard.step(None, REST, 100.0 + 0.005 * k)
    assert guard.arm(0.0, TOKEN)
    guard.step(command(0.0, 1), REST, 0.0)
    assert guard.mode == ARMED and guard.passed == 2


def test_commands_of_the_model_before_pass_for_the_changeover_and_no_longer():
    guard = armed()
    guard.serve("old", 0.0)
    guard.serve("new", 1.0)
    for t, passed in ((1.5, 1), (2.0, 2), (2.01, 2)):
        guard.step(command(t, round(100 * t), model_id="old"), REST, t)
        assert (guard.passed, guard.mode) == (passed, ARMED)
    guard.step(command(2.02, 203, model_id="new"), REST, 2.02)
    assert guard.passed == 3


def test_a_clock_that_is_set_back_does_not_lengthen_the_changeover():
    guard = armed(1000.0)
    guard.serve("old", 999.0)
    guard.serve("new", 1000.0)
    guard.step(command(1000.0, 1, model_id="old"), REST, 1000.0)
    guard.stop("clock")
    t = stand(guard, 0.0)
    assert guard.passed == 1 and guard.arm(t, TOKEN)
    guard.step(command(t, 2, model_id="old"), REST, t)
    assert guard.refusal == "command computed with model 'old', served is 'new'"
    guard.step(command(t + 0.001, 3, model_id="new"), REST, t + 0.005)
    assert (guard.passed, guard.refused) == (2, 1)


def test_to_serve_the_same_model_again_does_not_lengthen_the_changeover():
    guard = armed()
    guard.serve("old", 0.0)
    guard.serve("new", 0.0)
    guard.serve("new", 1.5)
    guard.step(command(1.6, model_id="old"), REST, 1.6)
    assert guard.passed == 0


def test_before_a_model_is_served_commands_of_any_model_pass():
    guard = armed()
    guard.step(command(0.0, 1, model_id="any"), REST, 0.0)
    guard.step(command(0.005, 2), REST, 0.005)
    assert guard.passed == 2
    guard.serve("first", 0.01)
    for k, model_id in enumerate(("any", "")):  # of no model that was served: there is no changeover
        guard.step(command(0.01, 3 + k, model_id=model_id), REST, 0.01)
        assert guard.refusal == f"command computed with model '{model_id}', served is 'first'"
    assert guard.passed == 2
    guard.step(command(0.01, 5, model_id="first"), REST, 0.01)
    assert guard.passed == 3


LABELS = (AxisLabel("axis 1 (base.rz)", "rad"), AxisLabel("axis 2 (slide.tx)", "m"))
RANGES = (JointRange(-1.0, 2.0, 10.0, 0.5),) * 2


@pytest.mark.parametrize(
    ("changes", "state", "why"),
    [
        (
            {"velocity": (9.0, 0.3)},
            GuardState((0.0, 0.4), (0.0, 0.0)),
            "axis 2 (slide.tx) is faster than it may be: 0.4 m/s of 0.3 m/s",
        ),
        (
            {"ranges": RANGES},
            GuardState((3.0, 0.0), (1.9, 0.0)),
            "axis 1 (base.rz) at 1.9 rad is too fast for the end of its range: 3 rad/s of 0.914 rad/s",
        ),
        (
            {"noise": (0.01, 0.002)},
            GuardState((0.0, 0.0), (0.0, 0.05)),
            "axis 2 (slide.tx) went 0.05 m in 5 ms, its velocity says 0 m",
        ),
    ],
)
def test_a_reason_names_the_axis_and_its_unit(changes, state, why):
    guard = armed(labels=LABELS, **changes)
    guard.step(command(0.0), REST, 0.0)
    guard.step(command(0.005, 2), state, 0.005)
    assert (guard.mode, guard.reason) == (BRAKING, why)


def test_what_keeps_a_guard_from_being_armed_names_the_axis_and_its_unit():
    guard = Guard(replace(LIMITS, labels=LABELS))
    guard.step(None, GuardState((0.0, -0.011), (0.0, 0.0)), 0.0)
    assert guard.unready() == "axis 2 (slide.tx) moves at -0.011 m/s, at rest it does up to 0.01 m/s"
