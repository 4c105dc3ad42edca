"""Damping and modal stiffness from the half-power bandwidth of one peak (seed 001).

    zeta = (f_b - f_a) / (2 f_0)        |H(f_a)| = |H(f_b)| = H_0 / sqrt 2        k = 1 / (2 H_0 zeta)

H_0 is the height of a receptance. Only at a drive point (same point and direction) is k the modal
stiffness, in N/m per unit force. Two modes within a bandwidth read as one: fit them.

The formula takes the resonance for symmetric. Of one mode, |H|^2 ~ 1 / ((s - s_0)^2 + d) over s = (f / f_n)^2
with s_0 = 1 - 2 zeta^2 and d = 4 zeta^2 (1 - zeta^2): half the power is left at s_0 +- sqrt d, and with the
undamped f_n for f_0, as a peak between the lines has it, the formula reads::

    zeta sqrt((2 - 2 zeta^2) / (1 - 2 zeta^2 + sqrt(1 - 8 zeta^2 + 8 zeta^4))) = zeta (1 + zeta^2 + ...)

That is 0.01 % of it too much at zeta = 1 %, 0.25 % at 5 %, 1.0 % at 10 % and 4.7 % at 20 %; k reads
3/2 zeta^2 of itself too little. On the lines f_0 is that of the maximum, and 2 zeta^2 is too much. Beyond
zeta = 38 % the curve does not fall to half power below its peak.

The crossings lie on chords of the curve, which begin at its peak. How far the damping of one mode is off by
that in addition, without noise, by the n lines that its band reads between the lines::

    between the lines    at most 17 % from n = 1, 11 % from 1.5, 6 % from 2, then 1 / (4 n^2)
    on the lines         -19 to +37 % from n = 3, -14 to +21 % from 5

The resonance is ``h(u) = 1 / sqrt(1 + u^2)``, u in half bandwidths from the peak. A chord from line to line,
2 / n apart, falls to h(1) too late by at most ``(2 / n)^2 / 8 * |h''(1) / h'(1)| = 1 / (4 n^2)``; the figures
are the largest over all places of the peak between the lines. With fewer lines nothing bounds the error
(on the lines +200 % at n = 1): such a reading is refused.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.modal.peaks import interpolate_peak

Array = NDArray[np.float64]

NEEDED_LINES = {  # in a band, read between the lines, by whether that is what is asked for
    True: 1.0,
    False: 3.0,
}


class LinesTooCoarseError(ValueError):
    """The lines are too far apart for the bandwidth of a peak."""


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
        LinesTooCoarseError: The band reads fewer than ``NEEDED_LINES``.
        ValueError: The climb ends at the edge, or the curve does not fall to half power on both sides.
    """
    line = _climb(magnitude, int(np.argmin(abs(np.asarray(f_hz) - near_hz))))
    peak = interpolate_peak(f_hz, magnitude, line)
    found = _read(f_hz, magnitude, (peak.f_hz, peak.height), True)
    read, needed = _lines_within(f_hz, found), NEEDED_LINES[interpolate]
    if read < needed:
        raise LinesTooCoarseError(
            f"lines too coarse for the half-power bandwidth at {found.f_hz:.6g} Hz: the band reads "
            f"{read:.2g} lines; needed are {needed:g} or more"
        )
    return found if interpolate else _read(f_hz, magnitude, (peak.line_hz, float(magnitude[line])), False)


def _read(f_hz: Array, magnitude: Array, top: tuple[float, float], interpolate: bool) -> HalfPower:
    """Return the band about a peak, of which ``top`` is frequency [Hz] and height."""
    sides = np.flatnonzero(f_hz < top[0])[::-1], np.flatnonzero(f_hz > top[0])  # from the peak outwards
    low, high = (
        _crossing(np.append(top[0], f_hz[side]), np.append(top[1], magnitude[side]), interpolate)
        for side in sides
    )
    return HalfPower(top[0], low, high, top[1])


def _climb(magnitude: Array, line: int) -> int:
    """Return the line of the local maximum uphill of a line."""
    while True:
        around = range(max(line - 1, 0), min(line + 2, len(magnitude)))
        best = max(around, key=lambda i: magnitude[i])
        if not magnitude[best] > magnitude[line]:  # nor where it is not a number
            return line
        line = best


def _crossing(f_hz: Array, magnitude: Array, interpolate: bool) -> float:
    """Return where a curve that begins at its peak (k,) falls to half the power that it has there [Hz]."""
    level = magnitude[0] / np.sqrt(2)
    i = int(np.argmin(magnitude >= level))  # the first that is not; 0 where all are
    if not magnitude[i] < level:  # nor where it is not a number
        raise ValueError(f"the curve does not fall to half power before {f_hz[i or -1]} Hz")
    share = (magnitude[i - 1] - level) / (magnitude[i - 1] - magnitude[i])
    if not interpolate:
        share = round(share)
    return float(f_hz[i - 1] + share * (f_hz[i] - f_hz[i - 1]))


def _lines_within(f_hz: Array, found: HalfPower) -> float:
    """Return how many lines wide a band is, by the widest gap between the lines within and around it."""
    first = np.searchsorted(f_hz, found.low_hz, "right") - 1
    last = np.searchsorted(f_hz, found.high_hz, "left")
    return float((found.high_hz - found.low_hz) / np.diff(f_hz[first : last + 1]).max())
