"""Let commands pass: the guard obeys the controller from now on, and the arm may move.

  flexarm arm

Also after a stop, once what stopped the arm is mended. The guard refuses while the arm moves or the
controller's margins are too small, and says why. Where the arm was stopped at another pose its loop is judged
there first: that takes some seconds, and is waited for. To stop: flexarm stop.

Exit codes: 0 armed; 1 refused; 2 there is no guard.
"""

from __future__ import annotations

import argparse
import sys
import time

from std_srvs.srv import Trigger

from flexarm_bringup.calling.caller_node import DONE, NOT_DONE, Caller, absolute, add_wait, operate
from flexarm_controller.margins.arming import ELSEWHERE

JUDGING = 15.0  # s that a verdict may take; 5 of an arm of six axes
ASK_PERIOD = 0.5  # s


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add_wait(parser)


def run(args: argparse.Namespace) -> int:
    """Arm; return the exit code."""
    return operate("arm", lambda caller: _arm(caller, args.wait))


def _arm(caller: Caller, wait: float) -> int:
    def ask() -> Trigger.Response:
        """Ask the guard once."""
        return caller.ask(absolute("guard/arm"), Trigger, Trigger.Request(), wait)

    answer = ask()
    if ELSEWHERE in answer.message:
        print("flexarm arm: waits until the loop has been judged where the arm is now", file=sys.stderr)
    end = time.monotonic() + JUDGING
    while ELSEWHERE in answer.message and time.monotonic() < end:
        caller.listen(ASK_PERIOD)
        answer = ask()
    if answer.success:
        print(answer.message)
        return DONE
    print(f"flexarm arm: refused: {answer.message}", file=sys.stderr)
    return NOT_DONE
