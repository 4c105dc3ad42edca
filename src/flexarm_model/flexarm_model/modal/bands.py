"""Root mean square of a signal in frequency bands, from time records or spectra.

    rms^2 = sum over lines of the band of  |Y_k|^2 (2 / N^2, once at 0 Hz and at half the rate)

Neighbouring bands share no line, so the squares of all bands add up to the square of the whole record
(Parseval). A density is integrated instead, linear between its lines.
"""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

Array = NDArray[np.float64]


def band_rms(y: Array, rate_hz: float, edges_hz: Array) -> Array:
    """Return the root mean square of time records in bands, (n_bands, m).

    Args:
        y: Evenly sampled records, (k, m).
        rate_hz: Samples per second [Hz].
        edges_hz: Ascending edges of the bands [Hz], (n_bands + 1,); a band holds its lower edge and not
            its upper one, but the last holds half the rate when that is its edge.

    Raises:
        ValueError: Records are empty or not finite, or the edges do not ascend within 0 .. rate/2.
    """
    y = np.asarray(y, dtype=float)
    if y.ndim != 2 or not y.size or not np.isfinite(y).all():
        raise ValueError(f"need finite records (k, m), not {y.shape}")
    edges = _checked(edges_hz, 0.0, rate_hz / 2)
    k = y.shape[0]
    lines = np.fft.rfftfreq(k, 1 / rate_hz)
    twice = np.where((lines == 0.0) | (np.arange(lines.size) * 2 == k), 1.0, 2.0)
    power = twice[:, None] * abs(np.fft.rfft(y, axis=0) / k) ** 2  # (lines, m)
    number = np.searchsorted(edges, lines, side="right") - 1
    if edges[-1] == rate_hz / 2:
        number[lines == edges[-1]] = edges.size - 2
    bands = np.array([power[number == i].sum(axis=0) for i in range(edges.size - 1)])
    return np.asarray(np.sqrt(bands))


def density_band_rms(f_hz: Array, density: Array, edges_hz: Array) -> Array:
    """Return the root mean square in bands of one-sided power densities, (n_bands, m).

    Args:
        f_hz: Lines, ascending [Hz], (k,).
        density: Unit squared per Hz, (k, m).
        edges_hz: Ascending edges of the bands within the lines [Hz], (n_bands + 1,).

    Raises:
        ValueError: A density is negative or not finite, or the edges do not ascend within the lines.
    """
    density = np.asarray(density, dtype=float)
    if not (np.isfinite(density).all() and (density >= 0.0).all()):
        raise ValueError("a density is negative or not finite")
    edges = _checked(edges_hz, float(f_hz[0]), float(f_hz[-1]))
    grid = np.union1d(f_hz, edges)
    values = np.column_stack([np.interp(grid, f_hz, column) for column in density.T])
    total = scipy.integrate.cumulative_trapezoid(values, grid, axis=0, initial=0.0)  # (lines, m)
    power = np.diff(total[np.searchsorted(grid, edges)], axis=0)
    return np.asarray(np.sqrt(np.maximum(power, 0.0)))


def _checked(edges_hz: Array, low: float, high: float) -> Array:
    edges = np.asarray(edges_hz, dtype=float)
    if edges.size < 2 or not ((np.diff(edges) > 0).all() and edges[0] >= low and edges[-1] <= high):
        raise ValueError(f"edges {edges} Hz must ascend within {low} .. {high} Hz")
    return edges
