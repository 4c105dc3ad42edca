"""What another model error could say by chance must be said twice, by windows that have nothing in common.

An arm whose gears have play fits badly where it crosses the gap, and two sound gauges, swapped, or an encoder
of the wrist in the place of the other explain some of it: a hundred squared sigmas, once. A channel that is
wrong is wrong in the next window, too. A plug that is off is clear sooner: it must be silent while the others
move, which model errors have made a gauge look like for 132 squared sigmas at most. A close look that has to
count on all of the process noise is at a window that the model does not bear out: it may say what another has
said before, or something that is beyond chance and leaves nothing to be explained. (Wrist motors of a worn 6R
that both run through their play were once called swapped for 2471.)
"""

from __future__ import annotations

from flexarm_estimator.isolation.hypotheses import FLIPPED, SWAPPED
from flexarm_estimator.isolation.isolation import Explanation

BEYOND_CHANCE = 400.0  # squared sigmas that no model error has been seen to give a rearrangement at once
CLOSE_BEYOND_CHANCE = 1000.0  # the same of a close look, which shows errors of the model, too
SILENT_BEYOND_CHANCE = 200.0  # the same of a channel that is silent, or at its limit
CONVINCING = 1.2  # misfit of a datum that an opinion below that may leave: a channel at fault explains all
PATIENCE = 2.0  # s; about the time to the next move
_REARRANGED = FLIPPED, SWAPPED


class SecondOpinion:
    """Keeps an explanation until another window has said the same.

    Attributes:
        first_tick: The first tick that this other window may contain; 0 when nothing waits for it.
    """

    def __init__(self, beyond: float = BEYOND_CHANCE) -> None:
        """Wait for nothing; from ``beyond`` squared sigmas on no rearrangement will have to."""
        self._beyond, self.first_tick, self._until = beyond, 0, 0.0
        self._awaited: Explanation | None = None

    def expire(self, t: float) -> None:
        """Give up at ``t`` [s] what has waited too long."""
        if self._awaited is not None and t > self._until:
            self._awaited, self.first_tick = None, 0

    def agrees(
        self, explanation: Explanation, t: float, last_tick: int, *, is_borne_out: bool = True
    ) -> bool:
        """Return whether an explanation may be told.

        Args:
            explanation: Of a window.
            t: Now [s].
            last_tick: Of that window.
            is_borne_out: The model fits the window, as far as this was asked.
        """
        is_convincing = explanation.spread <= CONVINCING
        is_repeated = self._awaited is not None and _is_same(self._awaited, explanation) and is_convincing
        beyond = self._beyond if _is_rearranged(explanation) or not is_borne_out else SILENT_BEYOND_CHANCE
        is_beyond = explanation.total >= beyond and (is_convincing or is_borne_out)
        if is_repeated or is_beyond:
            self._awaited, self.first_tick = None, 0
            return True
        if not (is_convincing and is_borne_out):
            return False
        self._awaited, self.first_tick, self._until = explanation, last_tick + 1, t + PATIENCE
        return False


def _is_same(one: Explanation, other: Explanation) -> bool:
    if one.channels != other.channels:
        return False
    return one.words == other.words or not (_is_rearranged(one) or _is_rearranged(other))


def _is_rearranged(explanation: Explanation) -> bool:
    return explanation.words in _REARRANGED
