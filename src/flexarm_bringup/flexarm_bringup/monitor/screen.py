"""A terminal that is drawn over again and left as it was: plain ANSI, alternate screen, hidden cursor.

Nothing is read from the keyboard and no terminal mode is changed, so that a killed monitor leaves at most a
hidden cursor behind (``tput cnorm``). Where the output is no terminal, frames follow each other as text.
"""

from __future__ import annotations

import os
import shutil
import signal
from collections.abc import Sequence
from types import FrameType, TracebackType
from typing import TextIO

ENTER, LEAVE = "\x1b[?1049h\x1b[?25l\x1b[2J", "\x1b[?25h\x1b[?1049l"
HOME, CLEAR_LINE, CLEAR_BELOW = "\x1b[H", "\x1b[K", "\x1b[J"
ENDING = (signal.SIGTERM, signal.SIGHUP)
FALLBACK = (110, 50)  # columns and lines where nobody says
UNCUT = (10_000, 10_000)


class Screen:
    """Draws frames; use it with ``with``."""

    def __init__(self, out: TextIO) -> None:
        """Draw on ``out``."""
        self._out = out
        self.is_terminal = out.isatty() and os.environ.get("TERM", "dumb") != "dumb"
        self.has_colour = self.is_terminal and "NO_COLOR" not in os.environ
        self._handlers: dict[int, object] = {}

    @property
    def size(self) -> tuple[int, int]:
        """Columns and lines, now; text that no terminal shows is as wide as it is."""
        if not self.is_terminal:
            return UNCUT
        size = shutil.get_terminal_size(FALLBACK)
        return size.columns, size.lines

    def show(self, lines: Sequence[str]) -> None:
        """Draw a frame over the one before; its last line says how many lines do not fit."""
        if not self.is_terminal:
            print("\n".join([*lines, ""]), file=self._out, flush=True)
            return
        shown = _cut(lines, max(self.size[1] - 1, 1))
        text = "".join(f"{line}{CLEAR_LINE}\r\n" for line in shown)
        self._out.write(f"{HOME}{text}{CLEAR_BELOW}")
        self._out.flush()

    def __enter__(self) -> Screen:
        """Take the terminal over."""
        for number in ENDING:
            self._handlers[number] = signal.signal(number, _interrupt)
        if self.is_terminal:
            self._out.write(ENTER)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Give it back."""
        if self.is_terminal:
            self._out.write(LEAVE)
            self._out.flush()
        for number, handler in self._handlers.items():
            signal.signal(number, handler)  # type: ignore[arg-type]


def _cut(lines: Sequence[str], room: int) -> list[str]:
    """Return at most ``room`` lines; the last of a longer text says how many more there are."""
    if len(lines) <= room:
        return list(lines)
    kept = list(lines[: room - 1])
    return [*kept, f"... {len(lines) - len(kept)} more lines"]


def _interrupt(number: int, frame: FrameType | None) -> None:
    raise KeyboardInterrupt
