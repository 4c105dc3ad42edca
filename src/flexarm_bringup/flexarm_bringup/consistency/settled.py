"""What counts of a run of the estimator: it settles after its start, and after every time it began anew."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.estimate import Estimate

SETTLING = 0.3  # s that do not count
_ROUNDING = 1e-9  # s


def beginnings(t: Sequence[float], max_gap: float) -> Iterator[int]:
    """Give the indices of the instants [s] at which a filter begins, or begins anew.

    Args:
        t: Of the estimates, in the order of the bag.
        max_gap: After a longer pause, or where time goes back, it begins anew [s].
    """
    for k, now in enumerate(t):
        if k == 0 or not 0.0 <= now - t[k - 1] <= max_gap:
            yield k


def is_settled(estimates: Iterable[Estimate]) -> NDArray[np.bool_]:
    """Return which estimates count, (k,); also a user who resets or sets the state lets it begin anew."""
    ages = np.array([estimate.age for estimate in estimates], dtype=float)
    return np.asarray(ages >= SETTLING - _ROUNDING)
