"""What ``flexarm rig`` prints, line by line, to a reader who may go."""

from __future__ import annotations

import time


class Lines:
    """Prints lines with the time since the start.

    Whoever is called by an executor must not raise; so it is noted that nobody reads any more ("| head").

    Attributes:
        cut_off: What printing raised then; None while somebody reads.
    """

    def __init__(self) -> None:
        """Let time begin."""
        self._started = time.monotonic()
        self.cut_off: BrokenPipeError | None = None

    def say(self, text: str) -> None:
        """Print a line; nothing when nobody reads."""
        if self.cut_off is None:
            try:
                print(f"[{time.monotonic() - self._started:6.2f} s] {text}", flush=True)
            except BrokenPipeError as error:
                self.cut_off = error
