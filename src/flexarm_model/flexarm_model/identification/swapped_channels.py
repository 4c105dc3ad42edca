"""Which channels speak for each other: by how much what they measure is like what is predicted of each.

With the likeness ``L_ij`` of what channel i measures to what is predicted of channel j, a pair leaves of its
answers, as it is wired and with its plugs exchanged::

    own      (1 - L_ii^2) + (1 - L_jj^2)          crossed  (1 - L_ij^2) + (1 - L_ji^2)

Two gauges on one beam are alike, so that each is still rather like its own prediction when they are swapped.
What is left tells them apart.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_model.identification.channel_findings import CheckedChannel

Array = NDArray[np.float64]
LEFT = 0.3  # of a pair's answers, from which something is wrong with it
CROSSED = 0.8  # share of that which may be left with the plugs exchanged


def likeness(measured: Array, predicted: Array) -> Array:
    """Return the cosine of every measured channel to every predicted one, both (motors, n, c), as (c, c)."""
    count = measured.shape[2]
    m, p = measured.reshape(-1, count), predicted.reshape(-1, count)
    sizes = np.outer(np.linalg.norm(m, axis=0), np.linalg.norm(p, axis=0))
    return np.asarray(m.T @ p / np.maximum(sizes, np.finfo(float).tiny))


def rivals(c: int, channels: Sequence[CheckedChannel]) -> list[int]:
    """Return the other channels of a channel's unit."""
    return [j for j, other in enumerate(channels) if other.unit == channels[c].unit and j != c]


def rival(c: int, channels: Sequence[CheckedChannel], alike: Array) -> int:
    """Return the other channel of its unit whose prediction it resembles most; itself when it is alone."""
    return max(rivals(c, channels), key=lambda j: abs(alike[c, j]), default=c)


def exchanged(channels: Sequence[CheckedChannel], alike: Array, judged: Collection[int]) -> dict[int, int]:
    """Return the partner of every channel of a pair whose plugs are exchanged.

    Args:
        channels: All of them.
        alike: Likeness of what each measures to what is predicted of each, (c, c).
        judged: Channels that the pushes move by more than their noise.
    """
    left = 1.0 - alike**2
    found: dict[int, int] = {}
    for i in judged:
        for j in set(judged) & set(rivals(i, channels)):
            own, crossed = left[i, i] + left[j, j], left[i, j] + left[j, i]
            if own > LEFT and crossed < CROSSED * own:
                best = found.get(i)
                found[i] = j if best is None or left[i, j] < left[i, best] else best
    return {i: j for i, j in found.items() if found.get(j) == i}
