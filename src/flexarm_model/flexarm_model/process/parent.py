"""A process that does not outlive who started it: the kernel sends it SIGTERM when that one ends (prctl(2)).

``ros2 launch`` ends its nodes when it is interrupted, but not when it is killed, or terminated by a service
manager: they would go on moving the arm with nobody above them. The launch file leaves its number in their
environment. A node that something else has started, in a terminal or a debugger, say, lives on its own.
"""

from __future__ import annotations

import ctypes
import os
import signal
from collections.abc import Callable, MutableMapping

MARK = "FLEXARM_PARENT"  # number of the process that nodes are to end with
_PR_SET_PDEATHSIG = 1  # linux/prctl.h


def ending_with(parent: int) -> Callable[[], bool]:
    """Return what a process calls, also between fork and exec, to end with its parent of that number.

    It returns False when the parent has ended before.
    """
    prctl = ctypes.CDLL(None, use_errno=True).prctl

    def ask() -> bool:
        """Make the calls."""
        prctl(_PR_SET_PDEATHSIG, signal.SIGTERM, 0, 0, 0)
        return os.getppid() == parent

    return ask


def end_with_parent(environment: MutableMapping[str, str] = os.environ) -> None:
    """End with the parent if it is the one that ``MARK`` names; those that we start are not meant.

    Raises:
        SystemExit: It ended while we asked.
    """
    named = environment.pop(MARK, "")
    if named == str(os.getppid()) and not ending_with(int(named))():
        raise SystemExit(0)
