"""Sandwich covariance of fitted parameters whose residuals are not white: from scores over blocks of time.

The score ``g_b = sum psi' S^-1 (nu + psi delta)`` is the gradient of the fit over a block b; blocks are
longer than residuals stay correlated, and older ones are forgotten as the sums forget [White1980]::

    cov delta = P (sum g_b g_b' + prior^-2) P          P = (sum psi' S^-1 psi + prior^-2)^-1

For white residuals of the size that the filter believes this is P. What the model leaves out of the arm comes
back in every move a little differently; it makes the scores scatter, and so widens the covariance.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
MEMORIES = 4  # blocks older than so many memories weigh nothing


class ScoreBlocks:
    """The sums of every block; the last one is open.

    Attributes:
        periods: Of a block [1].
    """

    def __init__(self, n_p: int, periods: int, keep: float) -> None:
        """Begin without any.

        Args:
            n_p: Number of parameters.
            periods: Of a block [1].
            keep: What a sum keeps over a period [1].
        """
        self.periods, self._keep = periods, keep**periods
        count = max(2, round(-MEMORIES / np.log(self._keep)))
        self._information, self._told = np.zeros((count, n_p, n_p)), np.zeros((count, n_p))
        self._open = 0

    def add(self, information: Array, told: Array) -> bool:
        """Take the sums of a period, (n_p, n_p) and (n_p,); return whether it ends a block."""
        if self._open == self.periods:
            self._information, self._told = (
                self._keep * np.roll(sums, 1, axis=0) for sums in (self._information, self._told)
            )
            self._information[0], self._told[0], self._open = 0.0, 0.0, 0
        self._information[0] += information
        self._told[0] += told
        self._open += 1
        return self._open == self.periods

    def forget(self, keep: float) -> None:
        """Weigh all that was taken by another share [1]: nothing was, for a while."""
        self._information, self._told = keep * self._information, keep * self._told

    def move(self, before: Array, after: Array, scale: Array) -> None:
        """Go on with parameters about another point.

        Args:
            before: What is known of them, (n_p,).
            after: The same about the other point, (n_p,).
            scale: Of a score there over one here, (n_p,).
        """
        scores = scale * (self._told + self._information @ before)
        self._information = scale[:, None] * self._information * scale
        self._told = scores - self._information @ after

    def scatter(self, delta: Array) -> Array:
        """Return ``sum g_b g_b'`` at parameters, (n_p, n_p)."""
        scores = self._told + self._information @ delta  # (blocks, n_p)
        return np.asarray(scores.T @ scores)
