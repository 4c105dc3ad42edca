"""Inputs that act for a moment: hits of a hammer, pulses.

A window weighs a hit by where it stands in a block, and its ringing by where that stands: the ratio is no
response, and its modes are wrong. Whole records that begin at rest and ring down need no window.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.identify.measurement import Records
from flexarm_bringup.identify.moving_inputs import moving_inputs

Array = NDArray[np.float64]
HALF_THE_POWER = 0.5
FEW_SAMPLES = 0.01  # share of a record's samples that hold half the power of a hit; of noise it is a tenth
LAST, STILL_RINGS = 0.05, 0.05  # share of a block at its end; of the largest, what has not died out there
DIED_OUT = 0.01  # of the largest, what has
NOISE = 2.0  # of the quietest part, up to which a part is no louder
PERCENT = 100.0


def are_hits(records: Sequence[Records]) -> bool:
    """Tell whether every input that moves does so for a moment, in every run."""
    moving = [x for _, _, x in moving_inputs([run.inputs for run in records])]
    return bool(moving) and all(is_hit(x) for x in moving)


def is_hit(x: Array) -> bool:
    """Tell whether a signal acts for a moment, (samples,)."""
    return _half_power_samples(x) <= FEW_SAMPLES * x.size


def told_of_hits(records: Sequence[Records], window: str, block: int) -> list[str]:
    """Return what is to be told of hits.

    Args:
        records: Runs whose inputs are hits.
        window: That was asked for; empty where nobody asked.
        block: Samples of a block.
    """
    unjudged = "the inputs are hits: no half of a record was predicted from the other, which rings only"
    if window not in ("", "boxcar"):
        return [
            unjudged,
            f"behind a {window} window a hit counts otherwise than its ringing and the modes come out wrong: "
            "leave --window out",
        ]
    told = [
        unjudged,
        f"blocks are {block} samples without a window: each has to begin at rest and to ring down within",
    ]
    rings = dict.fromkeys(name for run in records for name, y in run.outputs.items() if _rings(y[:block]))
    if rings:
        told.append(
            f"more than {PERCENT * STILL_RINGS:g} % of the largest is left at the end of a block: "
            f"{', '.join(rings)}; dampings come out wrong: record longer, or leave --resolution out"
        )
    return told


def rung_down(records: Sequence[Records]) -> int:
    """Return after how many samples no output rings any more, in any run; that of the longest at most."""
    return max(_rings_until(y) for run in records for y in run.outputs.values())


def _rings_until(y: Array) -> int:
    """Return after how many samples a signal is down to its noise, or to a hundredth of its largest part."""
    if _rings(y):
        return y.size
    size = max(1, int(LAST * y.size))
    rms = _loudness(y, size)
    loud = np.flatnonzero(rms > max(DIED_OUT * rms.max(), NOISE * rms.min()))
    return min(y.size, (int(loud.max(initial=0)) + 2) * size)


def _half_power_samples(x: Array) -> int:
    """Return how many of its largest samples hold half the power of a signal."""
    power = np.sort((x - np.median(x)) ** 2)[::-1]
    return int(np.searchsorted(np.cumsum(power), HALF_THE_POWER * power.sum())) + 1


def _rings(y: Array) -> bool:
    """Tell whether a signal has not died out in its last part, (samples,)."""
    rms = _loudness(y, max(1, int(LAST * y.size)))
    return bool(rms[-1] > STILL_RINGS * rms.max())


def _loudness(y: Array, size: int) -> Array:
    """Return the root mean square of parts of a signal, of so many samples each."""
    parts = y[: y.size // size * size].reshape(-1, size)
    return np.asarray(np.sqrt(np.mean((parts - np.median(y)) ** 2, axis=1)))
