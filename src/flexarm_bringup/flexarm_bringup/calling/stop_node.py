"""Stop the arm: the guard brakes it and lets no command pass until it is armed again.

  flexarm stop

Said on the topic stop and asked of the service guard/stop, whichever comes first, again and again until the
guard says that it has stopped; then it is watched until the arm has been braked. No replacement for the
switch that takes the power away: the command needs a computer, a network and a second or two.

Exit codes: 0 stopped; 1 the guard was told, and has not said that it has stopped; 2 there is no guard.
"""

from __future__ import annotations

import argparse
import sys
import time

from flexarm_interfaces.msg import GuardStatus
from std_msgs.msg import Empty
from std_srvs.srv import Trigger

from flexarm_bringup.calling.caller_node import (
    DONE,
    NOT_DONE,
    UNUSABLE,
    Caller,
    absolute,
    add_wait,
    operate,
)
from flexarm_model.ros.node import LATEST_QOS, RELIABLE_QOS

REPEAT = 0.1  # s between two times that it is said
_MODES = {GuardStatus.STOPPED: "stopped", GuardStatus.BRAKING: "braking", GuardStatus.ARMED: "armed again"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add_wait(parser)


def run(args: argparse.Namespace) -> int:
    """Stop the arm; return the exit code."""
    return operate("stop", lambda caller: _Stop(caller).run(args.wait))


class _Stop:
    """Tells the guard in both ways, and hears what it does."""

    def __init__(self, caller: Caller) -> None:
        self._caller = caller
        self._status: GuardStatus | None = None
        self._said, self._is_told = -REPEAT, False
        self._topic = caller.create_publisher(Empty, "stop", RELIABLE_QOS)
        self._service = caller.create_client(Trigger, "guard/stop")
        caller.create_subscription(GuardStatus, "guard_status", self._on_status, LATEST_QOS)

    def run(self, wait: float) -> int:
        """Say it until it is done; return the exit code."""
        if self._caller.listen(wait, self._has_stopped):
            if self._mode() == GuardStatus.BRAKING:
                self._print()
                self._caller.listen(wait, lambda: self._mode() != GuardStatus.BRAKING)
            self._print()
            return DONE
        if not self._is_told:
            where = f"nobody offers {absolute('guard/stop')}. Same ROS_DOMAIN_ID and discovery range?"
            print(f"flexarm stop: NOBODY WAS TOLD: {where}", file=sys.stderr)
            return UNUSABLE
        print(f"flexarm stop: it was said, and no guard has answered for {wait:g} s", file=sys.stderr)
        return NOT_DONE

    def _print(self) -> None:
        if self._status is not None:
            print(f"{_MODES[self._status.mode]}: {self._status.reason}", flush=True)

    def _has_stopped(self) -> bool:
        """Say it again when it is due; return whether the guard has said since that it has stopped."""
        now = time.monotonic()
        has_listener = self._topic.get_subscription_count() > 0
        if (has_listener or self._service.service_is_ready()) and now - self._said >= REPEAT:
            if has_listener:
                self._topic.publish(Empty())
            if self._service.service_is_ready():
                self._service.call_async(Trigger.Request())
            if not self._is_told:
                self._status = None  # what was heard before says nothing of this
            self._said, self._is_told = now, True
        return self._is_told and self._mode() in (GuardStatus.STOPPED, GuardStatus.BRAKING)

    def _mode(self) -> int | None:
        return None if self._status is None else self._status.mode

    def _on_status(self, msg: GuardStatus) -> None:
        self._status = msg
