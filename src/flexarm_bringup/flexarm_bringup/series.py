"""A series of steps that are taken one after the other, each when it can be, as long as there is progress.

A step is a function that tries: true when it is done, false when it must be tried again at the next look, and
``SeriesError`` when neither it nor what follows can be done. Time [s] is the caller's.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

Step = Callable[[], bool]


class SeriesError(Exception):
    """A step cannot be taken, and why."""


class Series:
    """Steps in turn, with patience.

    Attributes:
        outcome: None while steps are left, "" when all were taken, else why not.
    """

    def __init__(self, steps: Sequence[Step], patience: float, now: float) -> None:
        """Begin.

        Args:
            steps: In turn; their names are told when one takes too long.
            patience: Longest time without progress [s].
            now: The time [s].
        """
        self._steps, self._patience, self._moved = list(steps), patience, now
        self.outcome: str | None = None if steps else ""

    @property
    def is_over(self) -> bool:
        """Whether there is nothing more to be done."""
        return self.outcome is not None

    @property
    def is_last(self) -> bool:
        """Whether all steps but one are taken."""
        return len(self._steps) == 1

    def look(self, now: float) -> str | None:
        """Try the next step, at most one per look; returns the outcome."""
        if not self.is_over:
            try:
                self._try(now)
            except SeriesError as error:
                self.end(str(error))
        return self.outcome

    def note(self, now: float) -> None:
        """Take something else as progress."""
        self._moved = now

    def waited(self, now: float) -> float:
        """Return how long ago there was progress [s]."""
        return now - self._moved

    def end(self, reason: str) -> None:
        """Take no further step, unless all are taken already."""
        if not self.is_over:
            self.outcome = reason

    def _try(self, now: float) -> None:
        if self._steps[0]():
            self._steps.pop(0)
            self.note(now)
            self.outcome = None if self._steps else ""
        elif self.waited(now) > self._patience:
            step = self._steps[0].__name__.strip("_").replace("_", " ")
            raise SeriesError(f"no progress for {self._patience:g} s: {step}")
