"""Let commands pass: the guard obeys the controller from now on, and the arm may move.

  flexarm arm

Also after a stop, once what stopped the arm is mended. The guard refuses while the arm moves or the
controller's margins are too small, and says why. To stop: flexarm stop.

Exit codes: 0 armed; 1 refused; 2 there is no guard.
"""

from __future__ import annotations

import argparse
import sys

from std_srvs.srv import Trigger

from flexarm_bringup.calling.caller_node import DONE, NOT_DONE, CallError, absolute, add_wait, calling, tell


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add_wait(parser)


def run(args: argparse.Namespace) -> int:
    """Arm; return the exit code."""
    try:
        with calling("arm") as caller:
            answer = caller.ask(absolute("guard/arm"), Trigger, Trigger.Request(), args.wait)
    except CallError as error:
        return tell("arm", error)
    if answer.success:
        print(answer.message)
        return DONE
    print(f"flexarm arm: refused: {answer.message}", file=sys.stderr)
    return NOT_DONE
