"""``flexarm goto`` whose reader or terminal goes away: the arm comes to rest, as after Ctrl-C."""

from __future__ import annotations

import errno
import io
import os
import sys
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

pytestmark = [pytest.mark.ros, pytest.mark.unhurried]
goto_node = pytest.importorskip(
    "flexarm_bringup.calling.goto_node", reason="needs ROS and flexarm_interfaces"
)

from flexarm_interfaces.msg import GuardStatus, MotionStatus  # noqa: E402
from flexarm_interfaces.srv import MoveTip  # noqa: E402


class Graph:
    """Takes every goal, which is then under way for ever."""

    def __init__(self) -> None:
        self.asked: list[str] = []
        self.heard: dict[str, Callable[[Any], None]] = {}

    def create_subscription(self, kind: Any, topic: str, call: Callable[[Any], None], qos: Any) -> None:
        self.heard[topic] = call

    def ask(self, service: str, kind: Any, request: Any, wait: float) -> SimpleNamespace:
        self.asked.append(service.rpartition("/")[2])
        return SimpleNamespace(accepted=True, reason="", goal_id=7, duration=9.0)

    def listen(self, seconds: float, until: Callable[[], bool]) -> bool:
        self.heard["motion_status"](MotionStatus(goal_id=7, state=MotionStatus.EXECUTING, progress=0.3))
        return until()


class Screen(io.StringIO):
    """Takes some lines, and fails then."""

    def __init__(self, lines: int, error: int) -> None:
        super().__init__()
        self._lines, self._error = lines, error

    def write(self, text: str) -> int:
        if self.getvalue().count("\n") >= self._lines:
            raise OSError(self._error, os.strerror(self._error))
        return super().write(text)


@pytest.mark.parametrize("lines", [0, 1, 2])
@pytest.mark.parametrize("error", [errno.EPIPE, errno.EIO, errno.ENOSPC])
def test_who_does_not_see_the_goal_any_more_leaves_no_motion_behind(
    lines: int, error: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    graph = Graph()
    monkeypatch.setattr(sys, "stdout", Screen(lines, error))
    if error == errno.EPIPE:
        with pytest.raises(BrokenPipeError):
            goto_node._go(graph, 1.0, MoveTip.Request())
    else:
        assert goto_node._go(graph, 1.0, MoveTip.Request()) == goto_node.INTERRUPTED
    assert graph.asked == ["move_tip", "cancel"]


def test_a_controller_that_has_died_is_not_moving_the_arm(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its last word, "72 % ... moving", was repeated for five seconds."""
    graph, now = Graph(), [100.0]

    def listen(seconds: float, until: Callable[[], bool]) -> bool:
        now[0] += seconds
        if now[0] < 102.0:
            graph.heard["motion_status"](MotionStatus(goal_id=7, state=MotionStatus.EXECUTING))
        else:
            graph.heard["guard_status"](GuardStatus(reason="no command for 50 ms"))
        return until()

    monkeypatch.setattr(graph, "listen", listen)
    monkeypatch.setattr(goto_node.time, "monotonic", lambda: now[0])
    assert goto_node._go(graph, 1.0, MoveTip.Request()) == goto_node.NOT_DONE
    told = capsys.readouterr()
    assert sum("moving" in line for line in told.out.splitlines()) == 4  # one of them half a second old
    stopped = "the guard has stopped the arm: no command for 50 ms"
    assert f"nothing heard for 1.0 s; {stopped}" in told.out
    assert told.err.rstrip().endswith(f"of the goal for 5 s; {stopped}; is the controller running?")


@pytest.mark.parametrize(("distance", "said"), [(0.0123, "   12.30 mm to go"), (float("nan"), "? mm to go")])
def test_a_distance_that_is_not_known_is_no_number(distance: float, said: str) -> None:
    status = MotionStatus(goal_id=7, state=MotionStatus.ABORTED, progress=0.75, distance=distance, reason="x")
    line = goto_node._line(status)
    assert line.startswith(" 75 %") and said in line and line.endswith("given up: x") and "nan" not in line
