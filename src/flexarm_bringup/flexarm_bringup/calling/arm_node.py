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

from flexarm_bringup.calling.caller_node import DONE, NOT_DONE, Caller, absolute, add_wait, operate


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add_wait(parser)


def run(args: argparse.Namespace) -> int:
    """Arm; return the exit code."""
    return operate("arm", lambda caller: _arm(caller, args.wait))


def _arm(caller: Caller, wait: float) -> int:
    answer = caller.ask(absolute("guard/arm"), Trigger, Trigger.Request(), wait)
    if answer.success:
        print(answer.message)
        return DONE
    print(f"flexarm arm: refused: {answer.message}", file=sys.stderr)
    return NOT_DONE
