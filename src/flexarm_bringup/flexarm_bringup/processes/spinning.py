"""Hear what comes for a moment, and let Ctrl-C wait for its end.

The handler of a signal runs between any two lines of Python, also of a callback that an executor calls. An
exception that it raises there does not come back out of rclpy as what it was: it is a RuntimeError about an
argument, or nothing at all. So handlers are called when the executor has come back.
"""

from __future__ import annotations

from typing import Protocol

from flexarm_bringup.processes.asked_to_end import holding_signals_back

_LONGEST = 0.1  # s for which a signal may wait
MANY = 10  # callbacks of who hears a thousand messages a second: to hold signals back takes as long as one


class Executor(Protocol):
    """What is asked of an executor of rclpy."""

    def spin_once(self, timeout_sec: float) -> None:
        """Call back whoever is due, or wait for that."""


def spin_once(executor: Executor, seconds: float, most: int = 1) -> None:
    """Let an executor work once, or wait for so long [s], 0.1 s at most; then hear signals.

    Args:
        executor: Of rclpy.
        seconds: How long it may wait.
        most: How often it may work, if more is due.
    """
    with holding_signals_back():
        executor.spin_once(timeout_sec=min(seconds, _LONGEST))
        for _ in range(most - 1):
            executor.spin_once(timeout_sec=0.0)
