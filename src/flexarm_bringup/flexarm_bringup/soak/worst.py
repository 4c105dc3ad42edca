"""The moments of a soak in which the estimate was farthest from the truth, and what was going on."""

from __future__ import annotations

from dataclasses import dataclass
from operator import attrgetter

KEPT = 8
APART = 1.0  # s; what lies closer together is one moment


@dataclass(frozen=True)
class Moment:
    """One look at the tip.

    Attributes:
        t: Since the begin of the soak [s].
        error: Estimate from truth [m].
        doing: What the arm was doing.
        is_usable: Whether the estimator vouched for its state.
        said: What it said of it.
        fault: The last fault that a sensor was given, and when [s].
    """

    t: float
    error: float
    doing: str
    is_usable: bool
    said: str
    fault: str


class WorstMoments:
    """Keeps the few worst ones."""

    def __init__(self) -> None:
        """Keep nothing yet."""
        self._kept: list[Moment] = []

    def note(self, moment: Moment) -> None:
        """Look at a moment; they come in their order."""
        last = self._kept[-1] if self._kept else None
        if last is not None and moment.t - last.t < APART:
            if moment.error > last.error:
                self._kept[-1] = moment
            return
        self._kept.append(moment)
        if len(self._kept) > 2 * KEPT:
            worst = self.worst
            self._kept = [each for each in self._kept if each in worst or each is moment]

    @property
    def worst(self) -> tuple[Moment, ...]:
        """The worst ones, the worst first."""
        return tuple(sorted(self._kept, key=attrgetter("error"), reverse=True)[:KEPT])
