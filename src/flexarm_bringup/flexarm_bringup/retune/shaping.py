"""Rule for the shaper: the shortest that leaves little when the frequency is off by three sigma.

Designed for the slowest identified mode. Tried are ZV (half a period), MZV (three quarters), ZVD and EI (a
whole period); what a train of impulses leaves of the vibration of one, at a frequency that is off, is their
complex sum [Singer1990].
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from flexarm_model.motion.hump_shapers import ei
from flexarm_model.motion.shapers import Shaper, mzv, zv, zvd

LEFT = 0.05  # of the vibration, at most
SIGMAS = 3.0
NONE = Shaper("none", (0.0,), (1.0,))
SHAPERS: tuple[Callable[[float, float], Shaper], ...] = (zv, mzv, zvd, ei)


@dataclass(frozen=True)
class ShaperChoice:
    """A shaper and what it leaves.

    Attributes:
        shaper: Impulses.
        f_hz: It was designed for [Hz].
        zeta: The same [1].
        band: Relative error of the frequency that it must bear [1].
        left: Largest share of the vibration that is left within [1].
    """

    shaper: Shaper
    f_hz: float
    zeta: float
    band: float
    left: float


def choose_shaper(f_hz: float, zeta: float, doubt: float) -> ShaperChoice:
    """Return the shaper of a mode whose frequency is known to ``doubt``, one sigma, relative [1].

    Some shapers do not exist for a heavily damped mode; one that does not vibrate needs none.
    """
    omega, band = 2 * np.pi * f_hz, SIGMAS * doubt
    if zeta >= 1.0:
        return ShaperChoice(NONE, f_hz, zeta, band, 0.0)
    choices = [
        ShaperChoice(shaper, f_hz, zeta, band, _worst(shaper, omega, zeta, band))
        for shaper in _existing(omega, zeta)
    ]
    good = [choice for choice in choices if choice.left <= LEFT]
    return good[0] if good else min(choices, key=lambda choice: choice.left)


def vibration_left(shaper: Shaper, omega: float, zeta: float) -> float:
    """Return what is left of the vibration of a mode, of that of one impulse at the end [1]."""
    pole = -zeta * omega + 1j * omega * np.sqrt(1 - zeta**2)
    since = shaper.duration - np.array(shaper.delays)
    return float(abs(np.array(shaper.amplitudes) @ np.exp(pole * since)))


def _existing(omega: float, zeta: float) -> Iterator[Shaper]:
    for make in SHAPERS:
        with suppress(ValueError):  # no positive impulses
            yield make(omega, zeta)


def _worst(shaper: Shaper, omega: float, zeta: float, band: float) -> float:
    return max(vibration_left(shaper, omega * (1 + off), zeta) for off in np.linspace(-band, band, 9))
