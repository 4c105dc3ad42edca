"""Row 53 finds motors that drive a stopped arm, however late, and not a link that rings against its brake."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from flexarm_bringup.fault_drill.drive_time import driven_periods

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
