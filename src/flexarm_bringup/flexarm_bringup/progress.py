"""One line that says what is being done and for how long, so that nobody stares at a dead screen."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

PLAIN_PERIOD = 5.0  # s between lines where the line cannot be rewritten
FORETOLD = 10.0  # s after which is told how long it may still take


class Progress:
    """Prints to stderr: rewrites its line on a terminal, adds one now and then elsewhere."""

    def __init__(self) -> None:
        """Start counting."""
        self._start = time.monotonic()
        self._is_terminal = sys.stderr.isatty()
        self._last = -PLAIN_PERIOD
        self._step = ""

    def say(self, text: str) -> None:
        """Tell what is being done now; call it as often as you like."""
        now = time.monotonic() - self._start
        is_new = text.split(":")[0] != self._step
        if self._is_terminal:
            print(f"\r\x1b[K[{now:5.1f} s] {text}", end="", file=sys.stderr, flush=True)
        elif is_new or now - self._last >= PLAIN_PERIOD:
            print(f"[{now:5.1f} s] {text}", file=sys.stderr, flush=True)
            self._last = now
        self._step = text.split(":")[0]

    def tell(self, text: str) -> None:
        """Tell something that stays to be read, whatever is being done."""
        self.done()
        print(f"[{time.monotonic() - self._start:5.1f} s] {text}", file=sys.stderr, flush=True)

    def counted(self, doing: str, things: str) -> Callable[[int, int], None]:
        """Return who tells how many of how many things are done, and about how long the others take."""
        began = time.monotonic()

        def tell(done: int, of: int) -> None:
            """Tell it."""
            took = time.monotonic() - began
            is_foretold = took > FORETOLD and 1 < done < of
            left = f", about {_length(took * (of - done) / done)} left" if is_foretold else ""
            self.say(f"{doing}: {done} of {of} {things}{left}")

        return tell

    def done(self) -> None:
        """Leave the line."""
        if self._is_terminal:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)


def _length(seconds: float) -> str:
    """Return a time as one says it."""
    return f"{seconds:.0f} s" if seconds < 90.0 else f"{seconds / 60.0:.0f} min"
