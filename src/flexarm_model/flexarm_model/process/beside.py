"""What takes longer than a period, thought about beside the loop of a node.

It is written as a generator: it yields what takes long, as something to call, and goes on with the result.
Everything between is done by who drives it: at once, or in the loop when the result is there. What is called
runs in a thread, so it must share nothing with the loop that either of them changes.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Generator
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from typing import Any, TypeVar

from flexarm_model.process.punctual import be_ordinary

T = TypeVar("T")
Thoughts = Generator[Callable[[], Any], Any, T]
GIVING_WAY = 2e-4  # s after which a thread lets the loop go on; Python's own 5 ms are a whole period


def at_once(thoughts: Thoughts[T]) -> T:
    """Do all of it here and now."""
    result = None
    while True:
        try:
            work = thoughts.send(result)
        except StopIteration as end:
            return end.value  # type: ignore[no-any-return]
        result = work()


class Beside:
    """One ordinary thread for the work of all thoughts, in the order in which it came."""

    def __init__(self) -> None:
        """Begin no thread before there is work."""
        self._pool: ThreadPoolExecutor | None = None
        self._open: list[tuple[Thoughts[Any], Callable[[Any], None], Future[Any]]] = []

    @property
    def is_busy(self) -> bool:
        """Whether thoughts are under way."""
        return bool(self._open)

    def begin(self, thoughts: Thoughts[T], done: Callable[[T], None]) -> None:
        """Begin; ``done`` takes what they come to, at once where nothing of it takes long."""
        self._go_on(thoughts, done, partial(next, thoughts))

    def look(self) -> None:
        """Go on with those whose work is done; to be called by the loop, which it never keeps waiting."""
        going, self._open = self._open, []
        for thoughts, done, work in going:
            if work.done():
                self._go_on(thoughts, done, partial(thoughts.send, work.result()))
            else:
                self._open.append((thoughts, done, work))

    def drop(self, why: Exception) -> int:
        """Raise ``why`` where thoughts wait for work, which then comes to nothing; returns in how many."""
        dropped, self._open = self._open, []
        for thoughts, done, work in dropped:
            work.cancel()
            self._go_on(thoughts, done, partial(thoughts.throw, why))
        return len(dropped)

    def _go_on(
        self, thoughts: Thoughts[T], done: Callable[[T], None], step: Callable[[], Callable[[], Any]]
    ) -> None:
        try:
            work = step()
        except StopIteration as end:
            done(end.value)
            return
        if self._pool is None:
            self._pool = ThreadPoolExecutor(1, "beside", initializer=_give_way)
        self._open.append((thoughts, done, self._pool.submit(work)))


def _give_way() -> None:
    """Let the loop have its core, and the interpreter, as soon as it wants them."""
    sys.setswitchinterval(GIVING_WAY)
    be_ordinary()
