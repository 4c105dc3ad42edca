"""Whether somebody has asked a program to end: a signal is noted, nothing is raised.

An exception raised by a signal comes anywhere, also between the start of a child and the line that keeps its
number; while Python forks, it is printed and lost. Who watches children asks now and then instead, and who
is to be ended by an exception holds it back where it must not come.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType

ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def noting_signals() -> Iterator[Callable[[], bool]]:
    """Give a function that tells whether one of ``ENDING`` has come since; call it from the main thread."""
    with _noting(ENDING) as came:
        yield lambda: bool(came)


@contextmanager
def holding_signals_back() -> Iterator[None]:
    """Call the handlers of the ``ENDING`` that come meanwhile afterwards; only the main thread hears any."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    known = [(number, signal.getsignal(number)) for number in ENDING]
    handlers = {int(number): handler for number, handler in known if callable(handler)}
    with _noting(tuple(handlers)) as came:
        yield
    for number in came:
        handlers[number](number, None)


@contextmanager
def _noting(numbers: Sequence[int]) -> Iterator[list[int]]:
    came: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        """Remember that a signal came."""
        came.append(number)

    before = {number: signal.signal(number, note) for number in numbers}
    try:
        yield came
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
