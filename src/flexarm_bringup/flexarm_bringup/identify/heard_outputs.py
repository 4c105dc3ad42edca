"""Of measured responses: the band, the outputs that say nothing in it, what each of the others counts in."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.identify.measurement import Responses
from flexarm_model.modal.frf import Frf

Array = NDArray[np.float64]
QUIETEST = 1e-4  # noise of an output over its size below which it counts no more
DEAF = 0.8  # share of the lines on which an output may be incoherent; one that is more often is left out


def band_of(responses: Responses, wanted: tuple[float, float] | None) -> tuple[float, float]:
    """Return the band that was wanted, else the one that was excited, else all lines above 0 Hz [Hz].

    Raises:
        ValueError: There is no more than one line.
    """
    f_hz = responses.f_hz
    if f_hz.size < 2:
        raise ValueError(f"{f_hz.size} line(s) of frequency; a mode needs many")
    return wanted or responses.band_hz or (float(f_hz[0] or f_hz[1]), float(f_hz[-1]))


def deaf_outputs(responses: Responses, band_hz: tuple[float, float] | None, least: float) -> dict[str, float]:
    """Return outputs that are incoherent on most lines, with the share of those; not all of them."""
    low, high = band_of(responses, band_hz)
    inside = (responses.f_hz >= low) & (responses.f_hz <= high)
    shares = {
        output: max(
            float(np.sum(~(coherence[inside] >= least)) / max(int(inside.sum()), 1))
            for cell, coherence in responses.coherence.items()
            if cell[0] == output
        )
        for output in dict.fromkeys(cell[0] for cell in responses.coherence)
    }
    deaf = {output: share for output, share in shares.items() if share > DEAF}
    return deaf if len(deaf) < len(responses.outputs) else {}


def sizes_of(responses: Responses, frf: Frf, inside: NDArray[np.bool_]) -> Array:
    """Return what every output is counted in: its noise where the coherence tells it, (n_out,).

    ``var H = |H|^2 (1 - g) / g`` over the number of averages, which is the same for all.
    """
    rms = np.sqrt(np.mean(abs(frf.H) ** 2, axis=(0, 2)))
    if not responses.coherence:
        return rms if responses.kinds else np.ones_like(rms)
    noise = np.full(rms.size, np.nan)
    for o, output in enumerate(responses.outputs):
        known = [responses.coherence.get((output, i)) for i in responses.inputs]
        if all(values is not None for values in known):
            g = np.clip(np.array(known)[:, inside].T, 1e-9, 1.0)  # (k, n_in)
            power = abs(frf.H[:, o]) ** 2 * (1 - g) / g
            noise[o] = np.sqrt(np.median(power[np.isfinite(power)])) if np.isfinite(power).any() else np.nan
    known_noise = np.where(np.isfinite(noise), noise, rms)
    return np.asarray(np.maximum(np.maximum(known_noise, QUIETEST * rms), np.finfo(float).tiny))
