"""What may be wrong with the channels; every hypothesis says what they would have said were they well.

A flipped sign and two swapped channels are undone by rearranging what was said: the noise is the same, so the
filter's gains and innovation covariances are, too, and all of them run side by side.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.isolation.channels import Channels

Array = NDArray[np.float64]
FLIPPED, SWAPPED = "sign is flipped", "swapped with {}"
_KEPT = 32  # tables


@dataclass(frozen=True)
class Rearrangement:
    """What is wrong, and how it is undone: channel i is really ``sign[i]`` times what ``source[i]`` said.

    Attributes:
        channels: Those that are wrong; none for all well.
        words: What is wrong, "{i}" stands for the name of the sensor of channel i.
        source: (m,).
        sign: (m,).
    """

    channels: tuple[int, ...]
    words: str
    source: NDArray[np.intp]
    sign: Array


@dataclass(frozen=True)
class Hypotheses:
    """Several of them as one table.

    Attributes:
        all: The first is "all well".
        source, sign: Of every channel under every hypothesis, (m, n_h).
    """

    all: tuple[Rearrangement, ...]
    source: NDArray[np.int64]
    sign: Array

    @staticmethod
    def of(found: Sequence[Rearrangement]) -> Hypotheses:
        """Make the table."""
        source = np.array([one.source for one in found], dtype=np.int64)
        sign = np.array([one.sign for one in found])
        return Hypotheses(tuple(found), np.ascontiguousarray(source.T), np.ascontiguousarray(sign.T))

    def about(self, channels: Collection[int]) -> Hypotheses:
        """Return "all well" and those that blame nothing but ``channels``."""
        return Hypotheses.of([one for one in self.all if set(one.channels) <= set(channels)])

    def undo(self, Y: Array) -> Array:
        """Return what the channels should have said under every hypothesis when they said Y, (k, m, n_h)."""
        return np.asarray(Y[:, self.source] * self.sign)


@lru_cache(maxsize=_KEPT)
def rearrangements(channels: Channels, suspects: frozenset[int]) -> Hypotheses:
    """Return "all well", then every flipped sign and every swap of channels and of sensors that have several.

    Args:
        channels: All channels.
        suspects: Those that may be at fault.
    """
    m = len(channels.all)
    usual, plus = np.arange(m), np.ones(m)
    found = [Rearrangement((), "", usual, plus)]
    for i in sorted(suspects):
        sign = plus.copy()
        sign[i] = -1.0
        found.append(Rearrangement((i,), FLIPPED, usual, sign))
    for i, j in channels.twins:
        if i in suspects and j in suspects:
            source = usual.copy()
            source[[i, j]] = j, i
            found.append(Rearrangement((i, j), SWAPPED, source, plus))
    for one, other in channels.twin_sensors:
        if suspects.issuperset((*one, *other)):
            source = usual.copy()
            source[[*one, *other]] = [*other, *one]
            found.append(Rearrangement((*one, *other), SWAPPED, source, plus))
    return Hypotheses.of(found)
