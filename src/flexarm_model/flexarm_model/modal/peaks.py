"""Peaks of a resonance curve, found by prominence and interpolated between the lines.

Near a resonance ``1/|receptance|^2`` is quadratic in ``x = f^2``, and for one mode it is so
exactly: ``(x_0 - x)^2 + (2 zeta)^2 x_0 x`` but for a factor. A parabola through three lines
therefore gives the natural frequency, the damping and the height without bias.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

Array = NDArray[np.float64]

SHARPEST = 1e-12  # (2 zeta)^2 below which the parabola's rest is rounding


@dataclass(frozen=True)
class Peak:
    """One peak of a curve.

    Attributes:
        line: Index of the highest line.
        line_hz: Frequency of that line [Hz].
        f_hz: Natural frequency by interpolation [Hz]; ``line_hz`` when three lines do not make a peak.
        zeta: Damping ratio by interpolation [1]; nan when three lines do not tell.
        height: Highest value of the interpolated curve, in the curve's unit.
    """

    line: int
    line_hz: float
    f_hz: float
    zeta: float
    height: float


def pick_peaks(f_hz: Array, magnitude: Array, power: int = 0, prominence_db: float = 3.0) -> tuple[Peak, ...]:
    """Return the peaks of a curve, slowest first.

    Args:
        f_hz: Lines [Hz], (k,).
        magnitude: The curve, (k,).
        power: Power of j w over a receptance (``Frf.power``), undone for the interpolation.
        prominence_db: Smallest prominence of a peak.
    """
    level = 20 * np.log10(np.maximum(magnitude, np.finfo(float).tiny))
    lines = scipy.signal.find_peaks(level, prominence=prominence_db)[0]
    return tuple(interpolate_peak(f_hz, magnitude, int(line), power) for line in lines)


def interpolate_peak(f_hz: Array, magnitude: Array, line: int, power: int = 0) -> Peak:
    """Return the peak at an inner line of a curve (k,) over ``f_hz`` (k,); see ``pick_peaks``.

    Raises:
        ValueError: The line has no neighbour on one side.
    """
    if not 0 < line < len(f_hz) - 1:
        raise ValueError(f"line {line} of {len(f_hz)} is at the edge of the record")
    near = slice(line - 1, line + 2)
    as_line = Peak(line, float(f_hz[line]), float(f_hz[line]), float("nan"), float(magnitude[line]))
    if not magnitude[near].all():
        return as_line
    x0 = f_hz[line] ** 2
    x = f_hz[near] ** 2 / x0 - 1.0
    inverse = (f_hz[near] ** power / magnitude[near]) ** 2  # of the receptance, but for a factor
    a, b, c = np.polyfit(x, inverse / inverse[1], 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        top = -b / (2 * a)
        rest = c / a - top**2  # (2 zeta)^2 (1 - zeta^2) (f_0^2 / x0)^2
    if not (a > 0.0 and rest > SHARPEST and x[0] < top < x[2]):
        return as_line
    natural = float(np.hypot(1.0 + top, np.sqrt(rest)))  # f_0^2 / x0
    zeta = float(np.sqrt((1.0 - np.sqrt(1.0 - min(rest / natural**2, 1.0))) / 2))
    f_top = float(np.sqrt(x0 * (1.0 + top)))
    height = f_top**power / np.sqrt(a * rest * inverse[1])
    return Peak(line, float(f_hz[line]), float(np.sqrt(x0 * natural)), zeta, float(height))
