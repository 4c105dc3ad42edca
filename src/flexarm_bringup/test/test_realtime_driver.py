"""Who counts late cycles sets out again when the machine stood still before the start, or says so."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

pytestmark = pytest.mark.ros
pytest.importorskip("rclpy", reason="needs ROS")

STOPPED, ARMED = 0, 1


def setting_out(stops: int) -> tuple[Any, list[int]]:
    """Return a driver whose guard stops the arm so often before the start, and its starts so far."""
    from flexarm_bringup.realtime.driver_node import Driver

    driver, starts = object.__new__(Driver), list[int]()
    driver._guard = SimpleNamespace(mode=STOPPED, ticks=1, reason="no command for 50 ms")
    driver._ready = {"guard": True}
    driver._publisher = SimpleNamespace(get_subscription_count=lambda: 2)
    driver._client = SimpleNamespace(service_is_ready=lambda: True)

    def set_out(reference: Any, wait: Any) -> None:
        starts.append(len(starts))
        driver._guard.mode = ARMED if len(starts) > stops else STOPPED

    driver._set_out = set_out
    return driver, starts


@pytest.mark.parametrize("stops", [0, 1, 2])
def test_a_stop_before_the_start_is_followed_by_another_try(stops: int) -> None:
    driver, starts = setting_out(stops)
    driver._begin(None, lambda: "")
    assert len(starts) == stops + 1


def test_an_arm_that_is_stopped_again_and_again_is_an_error() -> None:
    from flexarm_bringup.realtime.driver_node import DriverError

    driver, starts = setting_out(9)
    with pytest.raises(DriverError, match="3 times before the start: no command for 50 ms"):
        driver._begin(None, lambda: "")
    assert len(starts) == 3
