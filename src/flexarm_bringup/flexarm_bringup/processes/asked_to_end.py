"""Whether somebody has asked a program to end: a signal is noted, nothing is raised.

An exception raised by a signal comes anywhere, also between the start of a child and the line that keeps its
number; while Python forks, it is printed and lost. Who watches children asks now and then instead.
"""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def noting_signals() -> Iterator[Callable[[], bool]]:
    """Give a function that tells whether one of ``ENDING`` has come since; call it from the main thread."""
    came: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        """Remember that a signal came."""
        came.append(number)

    before = {number: signal.signal(number, note) for number in ENDING}
    try:
        yield lambda: bool(came)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
