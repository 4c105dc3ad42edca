"""Why a loop of the manipulator cannot be closed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


class ClosureError(ValueError):
    """The loops do not close, or the pose is singular; the message names manipulator and pose."""


class OpenLoopsError(ClosureError):
    """An iteration that closes loops does not arrive.

    Attributes:
        q: Where it ended, (n_q,).
    """

    def __init__(self, text: str, q: NDArray[np.float64]) -> None:
        """Say so."""
        super().__init__(text)
        self.q = q
