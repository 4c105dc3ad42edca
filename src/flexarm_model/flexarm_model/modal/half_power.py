"""Damping and modal stiffness from the half-power bandwidth of one peak (seed 001).

    zeta = (f_b - f_a) / (2 f_0)        |H(f_a)| = |H(f_b)| = H_0 / sqrt 2        k = 1 / (2 H_0 zeta)

H_0 is the height of a receptance. Only at a drive point (same point and direction) is k the modal
stiffness, in N/m per unit force. On the grid of the lines the damping is off by 6 to 18 % when the
bandwidth is a few lines; between the lines it is not. Two modes within a bandwidth read as one: fit them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.modal.peaks import interpolate_peak

Array = NDArray[np.float64]


@dataclass(frozen=True)
class HalfPower:
    """What one peak tells.

    Attributes:
        f_hz: Frequency of the peak f_0 [Hz].
        low_hz: Lower half-power frequency f_a [Hz].
        high_hz: Upper half-power frequency f_b [Hz].
        height: H_0, in the curve's unit.
    """

    f_hz: float
    low_hz: float
    high_hz: float
    height: float

    @property
    def zeta(self) -> float:
        """Damping ratio [1]."""
        return (self.high_hz - self.low_hz) / (2 * self.f_hz)

    @property
    def stiffness(self) -> float:
        """Modal stiffness [N/m] when the curve is a drive-point receptance [m/N]."""
        return 1 / (2 * self.height * self.zeta)

    @property
    def mass(self) -> float:
        """Modal mass [kg], under the same condition."""
        return self.stiffness / (2 * np.pi * self.f_hz) ** 2


def half_power(f_hz: Array, magnitude: Array, near_hz: float, interpolate: bool = True) -> HalfPower:
    """Return what the peak nearest to a frequency tells.

    Args:
        f_hz: Lines [Hz], (k,).
        magnitude: A receptance's magnitude, or a curve of the CMIF of receptances, (k,).
        near_hz: Where to start climbing.
        interpolate: Peak by a parabola and crossings linear between lines, or everything on lines (a
            crossing then is the line whose value is nearest to the half-power level).

    Raises:
        ValueError: The climb ends at the edge, or the curve does not fall to half power on both sides.
    """
    line = _climb(magnitude, int(np.argmin(abs(np.asarray(f_hz) - near_hz))))
    peak = interpolate_peak(f_hz, magnitude, line)
    f_0, height = (peak.f_hz, peak.height) if interpolate else (peak.line_hz, float(magnitude[line]))
    level = height / np.sqrt(2)
    low = _crossing(f_hz[line::-1], magnitude[line::-1], level, interpolate)
    high = _crossing(f_hz[line:], magnitude[line:], level, interpolate)
    return HalfPower(f_0, low, high, height)


def _climb(magnitude: Array, line: int) -> int:
    """Return the line of the local maximum uphill of a line."""
    while True:
        around = range(max(line - 1, 0), min(line + 2, len(magnitude)))
        best = max(around, key=lambda i: magnitude[i])
        if not magnitude[best] > magnitude[line]:  # nor where it is not a number
            return line
        line = best


def _crossing(f_hz: Array, magnitude: Array, level: float, interpolate: bool) -> float:
    """Return the frequency where the curve, followed away from its peak, falls to ``level``."""
    below = np.flatnonzero(magnitude < level)
    if not below.size:
        raise ValueError(f"the curve does not fall to half power before {f_hz[-1]} Hz")
    i = int(below[0])
    if i == 0:  # the highest line itself is below half of the interpolated peak
        raise ValueError(f"lines too coarse for a half-power bandwidth at {f_hz[0]} Hz")
    share = (magnitude[i - 1] - level) / (magnitude[i - 1] - magnitude[i])
    if not interpolate:
        share = round(share)
    return float(f_hz[i - 1] + share * (f_hz[i] - f_hz[i - 1]))
