"""By the clock commands keep their distance, also when the timer between them calls once too often."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("rclpy", reason="needs ROS")
pytestmark = pytest.mark.ros

PERIOD = 0.005  # s
GAP = 0.55 * PERIOD


class Timer:
    """Keeps what it was set to."""

    timer_period_ns = 0
    is_running = False

    def cancel(self) -> None:
        self.is_running = False

    def reset(self) -> None:
        self.is_running = True


class FakeNode:
    """Gives out one timer and hears nothing."""

    def __init__(self) -> None:
        self.timer = Timer()

    def create_timer(self, period: float, callback: Any, clock: Any) -> Timer:
        return self.timer

    def create_subscription(self, *_: Any, **__: Any) -> None:
        return None


def test_a_timer_that_calls_too_early_lets_no_command_leave(monkeypatch: pytest.MonkeyPatch) -> None:
    """While an answer is worked out a timer of some tenths of a millisecond may become due more than once."""
    from flexarm_controller import states_node
    from flexarm_controller.pacing import Pacing

    monkeypatch.setattr(states_node, "subscribe_bytes", lambda *_: None)
    now, answered, node = [0.0], [], FakeNode()
    duties = states_node.Duties(lambda msg: None, lambda told: answered.append(told.stamp_ns), lambda: None)
    states = states_node.PacedStates(node, duties, PERIOD)
    states._pacing = Pacing(PERIOD, lambda: now[0])
    states.on_state(SimpleNamespace(stamp_ns=1))
    now[0] = 0.001
    states.on_state(SimpleNamespace(stamp_ns=2))
    states.on_later()  # it was due twice before, and is heard only now
    assert answered == [1]
    assert node.timer.is_running and node.timer.timer_period_ns == pytest.approx(
        1e9 * (GAP - now[0]), abs=1.0
    )
    now[0] = GAP
    states.on_later()
    assert answered == [1, 2] and not node.timer.is_running
    states.on_later()  # nothing waits
    assert answered == [1, 2] and not node.timer.is_running
