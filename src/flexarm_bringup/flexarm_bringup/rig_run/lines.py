"""What ``flexarm rig`` prints, line by line, to a reader who may go."""

from __future__ import annotations

import errno
import time

GONE = (errno.EPIPE, errno.EIO)


class Lines:
    """Prints lines with the time since the start.

    Whoever is called by an executor must not raise; so it is noted that nobody reads any more ("| head", a
    closed terminal). A line for which a disk is too full is lost: that is no reason to stop an arm.

    Attributes:
        cut_off: What printing raised when nobody read any more; None while somebody does.
    """

    def __init__(self) -> None:
        """Let time begin."""
        self._started = time.monotonic()
        self.cut_off: OSError | None = None

    def say(self, text: str) -> None:
        """Print a line; nothing when nobody reads."""
        if self.cut_off is None:
            try:
                print(f"[{time.monotonic() - self._started:6.2f} s] {text}", flush=True)
            except OSError as error:
                if error.errno in GONE:
                    self.cut_off = error
