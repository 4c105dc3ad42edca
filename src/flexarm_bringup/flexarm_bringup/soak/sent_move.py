"""A move that a soak has sent: when the arm moves, and where it stands afterwards."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.reference import Reference
from flexarm_model.conversions import NS_PER_S

REST = 0.8  # s after a move


class SentMove(NamedTuple):
    """One move.

    Attributes:
        goal: Actuated axes after it [rad or m], (n_theta,).
        zero_ns: Stamp of its beginning [ns].
        end_ns: And of its end.
    """

    goal: NDArray[np.float64]
    zero_ns: int
    end_ns: int

    @classmethod
    def of(cls, reference: Reference, zero_ns: int) -> SentMove:
        """Return the move of a reference that begins at a stamp [ns]."""
        return cls(reference.theta[-1], zero_ns, zero_ns + round(NS_PER_S * float(reference.t[-1])))

    def is_over(self, stamp_ns: int) -> bool:
        """Return whether the rest after it is over, too, at a stamp [ns]."""
        return stamp_ns >= self.end_ns + round(NS_PER_S * REST)

    def moves(self, stamp_ns: int, answer: str) -> bool:
        """Return whether the arm is to move at a stamp [ns], given the controller's word about the move."""
        return self.zero_ns <= stamp_ns < self.end_ns and not is_refused(answer)


def is_refused(answer: str) -> bool:
    """Return whether the controller's word about a reference is that it is not followed."""
    return answer.startswith("reference refused")
