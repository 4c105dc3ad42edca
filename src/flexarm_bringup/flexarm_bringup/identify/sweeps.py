"""Inputs that pass through a band once: swept and stepped sines.

Every frequency acts in one part of the record alone. A window weighs it by where that part stands in a block,
and what rings on from it by where that stands: the ratio is no response, and blocks are too few to average
that out. A whole record that begins and ends at rest needs no window.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy
from numpy.typing import NDArray

from flexarm_bringup.identify.measurement import Records
from flexarm_bringup.identify.moving_inputs import moving_inputs

Array = NDArray[np.float64]
PARTS = 24  # of the time in which an input acts; each is to hold few of its frequencies
LEAST_SAMPLES = 16  # of a part
ACTS = (0.01, 0.99)  # shares of the energy between which an input acts
HOLDS = (0.05, 0.5, 0.95)  # shares of a part's power below its lowest, its middle and its highest frequency
NARROW = 0.25  # of the whole band, what one part holds at most
QUIET = 1e-3  # of the loudest part's power, below which a part tells no frequency
FEWEST_LOUD = PARTS // 2
DRIVEN = 0.1  # of the median power over the band, from which a line counts as driven
STILL_MOVES = 0.05**2  # of a frequency's largest power, what has not died out at the end
NOISE = 30.0  # of the median power at the end, up to which a line may be noise


def swept_band(records: Sequence[Records]) -> tuple[float, float] | None:
    """Return the band through which every input that moves passes once, in every run [Hz]; None for others.

    Where it is known what was asked of the inputs, that is what counts.
    """
    moving = moving_inputs([run.instruments or run.inputs for run in records])
    bands = [passed_band(x, records[k].rate_hz) for k, _, x in moving]
    known = [band for band in bands if band is not None]
    if not known or len(known) < len(bands):
        return None
    return min(low for low, _ in known), max(high for _, high in known)


def passed_band(x: Array, rate_hz: float) -> tuple[float, float] | None:
    """Return the band through which a signal passes from one end to the other [Hz]; None for others."""
    parts = _parts(x)
    if parts is None:
        return None
    size = parts.shape[1]
    power = _power(parts)
    total = power.sum(axis=1)
    loud = power[total > QUIET * total.max()]
    if len(loud) < FEWEST_LOUD:
        return None
    share = np.cumsum(loud, axis=1) / loud.sum(axis=1, keepdims=True)
    low, middle, high = (np.sum(share < part, axis=1) for part in HOLDS)  # lines
    width, steps = int(high.max() - low.min()), np.diff(middle)
    one_way = bool((steps >= -1).all() or (steps <= 1).all())
    if not one_way or np.max(high - low) > NARROW * width:
        return None
    return _driven(x, rate_hz, (low.min() - 1) * rate_hz / size, (high.max() + 1) * rate_hz / size)


def moving_at_end(records: Sequence[Records], band_hz: tuple[float, float], samples: int) -> list[str]:
    """Return the outputs that have not come to rest, in some run, at the end of its first ``samples``.

    That is so where a frequency of the band has more there than a share of what it has anywhere, and more
    than noise: a mode that was cut off while it rings has no right damping, and may look like two.
    """
    size = samples // PARTS
    return list(
        dict.fromkeys(
            name
            for run in records
            for name, y in run.outputs.items()
            if _moves_at_end(y[samples - PARTS * size : samples].reshape(PARTS, size), run.rate_hz, band_hz)
        )
    )


def _moves_at_end(parts: Array, rate_hz: float, band_hz: tuple[float, float]) -> bool:
    """Tell whether something still moves in the last of all parts, (PARTS, samples)."""
    power = _power(parts)
    f_hz = np.fft.rfftfreq(parts.shape[1], 1.0 / rate_hz)
    last = power[-1]
    moves = (last > STILL_MOVES * power.max(axis=0)) & (last > NOISE * np.median(last))
    return bool(moves[(f_hz >= band_hz[0]) & (f_hz <= band_hz[1])].any())


def _power(parts: Array) -> Array:
    """Return the power of every part behind a window, (PARTS, lines)."""
    window = scipy.signal.get_window("hann", parts.shape[1])
    centred = parts - parts.mean(axis=1, keepdims=True)
    return np.asarray(abs(np.fft.rfft(centred * window, axis=1)) ** 2)


def _driven(x: Array, rate_hz: float, low_hz: float, high_hz: float) -> tuple[float, float]:
    """Return the lowest and the highest line between two frequencies that a signal drives [Hz]."""
    f_hz = np.fft.rfftfreq(x.size, 1.0 / rate_hz)
    inside = (f_hz > 0.0) & (f_hz >= low_hz) & (f_hz <= high_hz)
    power = abs(np.fft.rfft(x - np.median(x))) ** 2
    driven = f_hz[inside & (power > DRIVEN * np.median(power[inside]))]
    return float(driven[0]), float(driven[-1])


def _parts(x: Array) -> Array | None:
    """Return the parts of the time in which a signal acts, (PARTS, samples); None where that is short."""
    if not np.isfinite(x).all():
        return None
    energy = np.cumsum((x - np.median(x)) ** 2)
    begin, end = np.searchsorted(energy, np.array(ACTS) * energy[-1])
    size = int(end - begin) // PARTS
    return x[begin : begin + PARTS * size].reshape(PARTS, size) if size >= LEAST_SAMPLES else None
