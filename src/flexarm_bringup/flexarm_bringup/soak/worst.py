"""The moments of a soak in which the estimate was farthest from the truth, and what was going on."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from operator import attrgetter

KEPT = 5
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
    """Keeps the few worst ones, of the states that were vouched for and of those that were not."""

    def __init__(self) -> None:
        """Keep nothing yet."""
        self._kept: dict[bool, list[Moment]] = {True: [], False: []}

    def note(self, moment: Moment) -> None:
        """Look at a moment; they come in their order."""
        kept = self._kept[moment.is_usable]
        last = kept[-1] if kept else None
        if last is not None and moment.t - last.t < APART:
            if moment.error > last.error:
                kept[-1] = moment
            return
        kept.append(moment)
        if len(kept) > 2 * KEPT:
            worst = _worst(kept)
            kept[:] = [each for each in kept if each in worst or each is moment]

    @property
    def worst(self) -> tuple[Moment, ...]:
        """The worst ones, the worst first; those that were vouched for come before all others."""
        return _worst(self._kept[True]) + _worst(self._kept[False])


def _worst(moments: Iterable[Moment]) -> tuple[Moment, ...]:
    return tuple(sorted(moments, key=attrgetter("error"), reverse=True)[:KEPT])
