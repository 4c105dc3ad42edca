"""What may be wrong with the channels; every hypothesis says what they would have said were they well.

A flipped sign and two swapped channels are undone by rearranging what was said: the noise is the same, so the
filter's gains and innovation covariances are, too, and all of them run side by side.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.isolation.channels import Channels

Array = NDArray[np.float64]
FLIPPED = "sign is flipped"


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


def rearrangements(channels: Channels, trusted: Collection[int]) -> list[Rearrangement]:
    """Return "all well", then every flipped sign and every swap.

    Args:
        channels: All channels.
        trusted: Those that may be accused.
    """
    m = len(channels.all)
    usual, plus = np.arange(m), np.ones(m)
    found = [Rearrangement((), "", usual, plus)]
    for i in sorted(trusted):
        sign = plus.copy()
        sign[i] = -1.0
        found.append(Rearrangement((i,), FLIPPED, usual, sign))
    for i, j in channels.twins:
        if i in trusted and j in trusted:
            source = usual.copy()
            source[[i, j]] = j, i
            found.append(Rearrangement((i, j), "swapped with {}", source, plus))
    return found


def undo(hypotheses: Sequence[Rearrangement], Y: Array) -> Array:
    """Return what the channels should have said under every hypothesis, (k, m, n_h).

    Args:
        hypotheses: n_h of them.
        Y: What they said, (k, m).
    """
    sources = np.array([hypothesis.source for hypothesis in hypotheses])
    signs = np.array([hypothesis.sign for hypothesis in hypotheses])
    return np.ascontiguousarray(np.moveaxis(Y[:, sources] * signs, 1, 2))
