"""What counts of a run of the estimator: it settles after its start, and after every time it began anew."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.settings import EstimatorConfig

Array = NDArray[np.float64]
SETTLING = 0.3  # s that do not count


def beginnings(t: Sequence[float], max_gap: float) -> Iterator[int]:
    """Give the indices of the instants [s] at which a filter begins, or begins anew.

    Args:
        t: Of the estimates, in the order of the bag.
        max_gap: After a longer pause, or where time goes back, it begins anew [s].
    """
    for k, now in enumerate(t):
        if k == 0 or not 0.0 <= now - t[k - 1] <= max_gap:
            yield k


def is_settled(t: Sequence[float], settings: EstimatorConfig) -> NDArray[np.bool_]:
    """Return which instants [s] count, (k,)."""
    settled = np.zeros(len(t), dtype=bool)
    starts = [*beginnings(t, settings.max_gap), len(t)]
    for first, end in zip(starts[:-1], starts[1:], strict=True):
        settled[first:end] = np.array(t[first:end]) >= t[first] + SETTLING
    return settled
