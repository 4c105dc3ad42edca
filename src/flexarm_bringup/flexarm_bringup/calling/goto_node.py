"""Move the tip to a place and tell how far it has got, until it stands there or cannot.

  flexarm goto 0.5543 0.32             X Y [Z] in the base frame [m]; as fast as the limits allow
  flexarm goto 0.5543 0.32 --time 2    in 2 s
  flexarm goto 0.5543 0.32 --tolerance 0.01    it may come to rest 10 mm beside it

The guard has to be armed (flexarm arm). Ctrl-C, and a terminal that is closed, bring the arm to rest within
its limits; flexarm stop brakes it. With an orientation: flexarm call controller/move_tip.

Exit codes: 0 the tip stands still there; 1 refused, canceled or given up, with the reason; 2 there is no
controller; 130 after Ctrl-C.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Callable
from contextlib import suppress

from flexarm_interfaces.msg import GuardStatus, MotionStatus
from flexarm_interfaces.srv import CancelMotion, MoveTip

from flexarm_bringup.arguments import number
from flexarm_bringup.calling.caller_node import (
    DONE,
    NOT_DONE,
    Caller,
    absolute,
    add_wait,
    operate,
)
from flexarm_bringup.processes.asked_to_end import noting_signals
from flexarm_model.ros.node import GOALS_QOS, RELIABLE_QOS

INTERRUPTED = 130  # what a shell reports for Ctrl-C
SILENCE = 5.0  # s without a word of the controller, which speaks 20 times a second
LINE_PERIOD = 0.5  # s between two lines of progress
_STATES = {
    MotionStatus.ACCEPTED: "accepted", MotionStatus.EXECUTING: "moving", MotionStatus.SUCCEEDED: "there",
    MotionStatus.CANCELED: "canceled", MotionStatus.REJECTED: "rejected", MotionStatus.ABORTED: "given up",
}  # fmt: skip
_UNDER_WAY = (MotionStatus.ACCEPTED, MotionStatus.EXECUTING)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    for axis in ("x", "y"):
        parser.add_argument(axis, type=number(), metavar=axis.upper(), help="of the tip [m]")
    parser.add_argument("z", type=number(), nargs="?", default=0.0, metavar="Z", help="of the tip [m]; 0")
    parser.add_argument(
        "--time", type=number(above=0.0), default=0.0, metavar="S", help="of the motion; the shortest"
    )
    parser.add_argument(
        "--tolerance", type=number(above=0.0), default=0.0, metavar="M", help="beside the place; 0.1 mm"
    )
    add_wait(parser)


def run(args: argparse.Namespace) -> int:
    """Move the tip; return the exit code."""
    request = MoveTip.Request(duration=args.time, tolerance=args.tolerance)
    request.target.orientation.w = 1.0
    place = request.target.position
    place.x, place.y, place.z = args.x, args.y, args.z
    return operate("goto", lambda caller: _go(caller, args.wait, request))


def _go(caller: Caller, wait: float, request: MoveTip.Request) -> int:
    # asked to end between the request and its answer, it would leave a motion that nobody watches
    with noting_signals() as asked_to_end:
        return _Goal(caller, wait, asked_to_end).run(request)


class _Goal:
    """Asks for a goal and follows it."""

    def __init__(self, caller: Caller, wait: float, asked_to_end: Callable[[], bool]) -> None:
        self._caller, self._wait, self._asked_to_end = caller, wait, asked_to_end
        self._goal, self._heard = 0, 0.0
        self._last: dict[int, MotionStatus] = {}  # by goal: it may speak before the answer is here
        self._guard = GuardStatus(mode=GuardStatus.ARMED)
        caller.create_subscription(MotionStatus, "motion_status", self._on_status, GOALS_QOS)
        caller.create_subscription(GuardStatus, "guard_status", self._on_guard, RELIABLE_QOS)

    def run(self, request: MoveTip.Request) -> int:
        """Ask, follow, return the exit code; where nobody reads any more the arm comes to rest."""
        answer = self._caller.ask(absolute("controller/move_tip"), MoveTip, request, self._wait)
        if not answer.accepted:
            print(f"flexarm goto: refused: {answer.reason}", file=sys.stderr)
            return NOT_DONE
        remark = f"; {answer.reason}" if answer.reason else ""
        self._goal, self._heard = answer.goal_id, time.monotonic()
        try:
            print(f"goal {answer.goal_id} accepted, {answer.duration:.2f} s{remark}", flush=True)
            return self._follow()
        except OSError as error:  # the terminal is closed, the reader of a pipe gone
            with suppress(OSError):
                self._cancel()
            if isinstance(error, BrokenPipeError):
                raise
            return INTERRUPTED

    def _follow(self) -> int:
        """Say how far the goal has got until it is over; return the exit code."""
        while not self._asked_to_end():
            self._caller.listen(LINE_PERIOD, lambda: self._is_over() or self._asked_to_end())
            silence = time.monotonic() - self._heard
            if silence > LINE_PERIOD:
                print(f"nothing heard for {silence:.1f} s{self._stopped()}", flush=True)
            elif self._goal in self._last:
                print(_line(self._last[self._goal]), flush=True)
            if self._is_over():
                return DONE if self._last[self._goal].state == MotionStatus.SUCCEEDED else NOT_DONE
            if silence > SILENCE:
                said = f"nothing heard of the goal for {SILENCE:g} s{self._stopped()}"
                print(f"flexarm goto: {said}; is the controller running?", file=sys.stderr)
                return NOT_DONE
        self._cancel()
        return INTERRUPTED

    def _cancel(self) -> None:
        """Bring this motion to rest, nobody else's."""
        request = CancelMotion.Request(goal_id=self._goal)
        answer = self._caller.ask(absolute("controller/cancel"), CancelMotion, request, self._wait)
        print(f"goal {self._goal}: {'coming to rest' if answer.accepted else answer.reason}", flush=True)

    def _stopped(self) -> str:
        """Return that the guard has stopped the arm, and why; nothing while it has not."""
        guard = self._guard
        return "" if guard.mode == GuardStatus.ARMED else f"; the guard has stopped the arm: {guard.reason}"

    def _is_over(self) -> bool:
        status = self._last.get(self._goal)
        return status is not None and status.state not in _UNDER_WAY

    def _on_guard(self, msg: GuardStatus) -> None:
        self._guard = msg

    def _on_status(self, msg: MotionStatus) -> None:
        if msg.goal_id:
            self._last[msg.goal_id] = msg
        if msg.goal_id == self._goal:
            self._heard = time.monotonic()


def _line(status: MotionStatus) -> str:
    """Return how far a goal has got."""
    reason = f": {status.reason}" if status.reason else ""
    known = math.isfinite(status.distance)
    far = f"{1e3 * status.distance:8.2f} mm to go" if known else f"{'?':>8} mm to go"
    return f"{100 * status.progress:3.0f} %  {far}  {_STATES.get(status.state, '')}{reason}"
