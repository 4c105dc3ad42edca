"""Row 53 finds a guard that brakes late, and tells for how long motors drive a stopped arm.

A link that rings against its brake is not driven.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from flexarm_bringup.fault_drill import stop_rows
from flexarm_bringup.fault_drill.controller_stand import ControllerStand
from flexarm_bringup.fault_drill.drive_time import driven_periods, last_period, until_braked
from flexarm_controller.guard import Guard, GuardCommand, GuardState

REST = 0.01  # rad/s
PERIODS = 60


def braked() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return power [W] and velocities [rad/s] of a stop from 1 rad/s, pushed in its first period."""
    power, theta_dot = np.zeros(PERIODS), np.zeros((PERIODS, 2))
    theta_dot[:10, 0] = np.linspace(1.0, 0.0, 10)
    power[0], power[1:10] = 1.5, -2.0 * theta_dot[1:10, 0]
    return power, theta_dot


def test_what_pushes_at_the_instant_of_the_stop_is_driven_for_a_period() -> None:
    assert driven_periods(*braked(), REST) == 1


@pytest.mark.parametrize("late", [15, 40, PERIODS - 1])
def test_a_push_after_periods_without_one_counts(late: int) -> None:
    power, theta_dot = braked()
    power[late], theta_dot[late, 1] = 0.3, -0.1
    assert driven_periods(power, theta_dot, REST) == late + 1


def test_what_a_held_axis_gives_back_to_a_ringing_link_is_no_drive() -> None:
    power, theta_dot = braked()
    power[20:], theta_dot[20:, 0] = 0.1 * (-1.0) ** np.arange(PERIODS - 20), 0.05
    assert driven_periods(power, theta_dot, REST) == 1


def test_an_arm_at_rest_is_not_driven() -> None:
    power, theta_dot = braked()
    power[40], theta_dot[40] = 0.5, 0.9 * REST
    assert driven_periods(power, theta_dot, REST) == 1
    assert driven_periods(np.zeros(5), np.zeros((5, 2)), REST) == 0


def test_an_arm_that_is_driven_all_the_time_is_so_to_the_end() -> None:
    assert driven_periods(np.ones(8), np.ones((8, 2)), REST) == 8


def test_what_holds_again_after_a_while_counts_to_its_end() -> None:
    assert last_period(np.array([True, False, False, True, False])) == 4
    assert last_period(np.array([False, False])) == 0
    assert last_period(np.array([], bool)) == 0


@pytest.mark.parametrize(
    ("seconds", "kept"), [(0.015, [True, True]), (0.03, [False, True]), (0.06, [False, False])]
)
def test_a_stop_is_braked_within_a_period_and_10_ms_and_never_after_more_than_50(
    seconds: float, kept: list[bool]
) -> None:
    assert [found.passed for found in until_braked(np.full(40, seconds), 0.005)] == kept


@pytest.mark.parametrize("late", [0, 4])
def test_a_guard_that_obeys_commands_for_some_periods_after_the_button_is_found(
    late: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    stand = ControllerStand("single_link")
    waiting: list[int] = []
    step, stop = Guard.step, Guard.stop

    def stop_later(guard: Guard, reason: str) -> None:
        if reason == "button" and late:
            waiting.append(late)
        else:
            stop(guard, reason)

    def step_on(guard: Guard, command: GuardCommand | None, state: GuardState, t: float) -> list[float]:
        if waiting:
            waiting[0] -= 1
            if waiting[0] < 0:
                waiting.clear()
                stop(guard, "button")
        return step(guard, command, state, t)

    monkeypatch.setattr(Guard, "stop", stop_later)
    monkeypatch.setattr(Guard, "step", step_on)
    monkeypatch.setattr(stop_rows, "STOPS", 6)  # strain stops four of them before the button
    found = {finding.what: finding for finding in stop_rows.stops(stand)}
    assert found["braked after, at most"].measured == pytest.approx((1 + late) * stand.dt)
    assert found["braked after, 99 %"].passed == (late == 0)
