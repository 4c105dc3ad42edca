"""In which order a controller in lockstep hears of the guard and answers states: that of the bag."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("rclpy", reason="needs ROS and flexarm_interfaces")

from flexarm_controller.states_node import FARTHEST_AHEAD, Duties, TickedStates  # noqa: E402

TICK = "header", "sequence", "topics", "counts"


class Topics:
    """Stands in for a node, and notes what is done."""

    def __init__(self) -> None:
        self.heard: dict[str, Callable[[Any], None]] = {}
        self.done: list[str] = []
        node: Any = SimpleNamespace(create_subscription=self._subscribe)
        self.states = TickedStates(node, Duties(self._join, self._answer, lambda: None))
        self._count = -1

    def _subscribe(self, _: Any, topic: str, call: Callable[[Any], None], __: Any) -> None:
        self.heard[topic] = call

    def _join(self, msg: Any) -> None:
        self.done.append(f"guard {msg}")

    def _answer(self, told: Any) -> None:
        self.done.append(f"state {told.stamp_ns}")

    def tick(self, at: int) -> None:
        """Say what the guard says at an instant [ns], and that it is complete."""
        self.heard["guard_status"](at)
        self._count += 1
        stamp = SimpleNamespace(sec=0, nanosec=at)
        told = SimpleNamespace(stamp=stamp), self._count, ["guard_status"], [1]
        self.heard["tick"](SimpleNamespace(**dict(zip(TICK, told, strict=True))))

    def state(self, at: int) -> None:
        told: Any = SimpleNamespace(stamp_ns=at)
        self.states.on_state(told)


def test_a_state_is_answered_with_what_the_guard_had_said_by_then() -> None:
    """A rig that brakes was ahead: the state before a stop was answered as if after it."""
    topics = Topics()
    topics.tick(1)
    topics.tick(2)
    topics.state(1)
    topics.state(2)
    assert topics.done == ["guard 1", "state 1", "guard 2", "state 2"]


def test_a_state_waits_for_its_tick_and_none_is_skipped() -> None:
    topics = Topics()
    for at in (1, 2):
        topics.state(at)
    assert topics.done == []
    topics.tick(1)
    assert topics.done == ["guard 1", "state 1"]
    topics.tick(2)
    assert topics.done[2:] == ["guard 2", "state 2"]


def test_states_go_on_where_a_clock_is_set_back() -> None:
    topics = Topics()
    topics.tick(100)
    topics.state(101)  # its tick never comes
    topics.tick(5)
    topics.state(5)
    topics.tick(6)
    topics.state(6)
    assert topics.done == ["guard 100", "guard 5", "state 5", "guard 6", "state 6"]


def test_the_guard_is_heard_also_where_no_state_comes() -> None:
    topics = Topics()
    for at in range(FARTHEST_AHEAD + 3):
        topics.tick(at)
    assert topics.done == ["guard 0", "guard 1", "guard 2"]
