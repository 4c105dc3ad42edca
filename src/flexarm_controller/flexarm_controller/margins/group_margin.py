"""Gain and delay margins of all torques at once, as a wrong motor constant or a late bus changes them.

With every torque times ``g`` the loop has as many unstable eigenvalues as ``det(1 - (g - 1) T)`` turns about
zero, ``T`` being the loop's answers of the torques to torques, ``(n_u, n_u)`` at every angle. Each torque
late by the same time gives the same with ``T_late - T``; see ``delay_margin``.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.margins.delay_margin import MOST, late
from flexarm_controller.margins.full_plant import PARTS
from flexarm_controller.margins.gain_margin import GainMargin
from flexarm_controller.margins.paired_roots import PairedRoots

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
STEP_DB, FARTHEST_DB = 0.5, 40.0  # of the search for factors
HALVINGS = 8


def group_gain_margin(answer: Complex) -> GainMargin:
    """Return the margins of a stable loop from its answers, (k, n_u, n_u)."""
    roots = PairedRoots(answer)

    def is_unstable(db: float) -> bool:
        """Say whether so much more gain makes the loop unstable."""
        return bool(roots.unstable_zeros(10.0 ** (db / 20.0) - 1.0))

    up, down = (_first(is_unstable, sign) for sign in (1.0, -1.0))
    return GainMargin(10.0 ** (up / 20.0), 10.0 ** (-down / 20.0))


def group_delay_margin(answer: Complex, of_early: Complex, angles: Array) -> float:
    """Return the margin in periods, at most ``MOST``.

    Args:
        answer: To torques held over the period, (k, n_u, n_u).
        of_early: To what of them is due to the first parts of the period, (PARTS + 1, k, n_u, n_u).
        angles: From 0 to pi [rad], (k,).
    """
    for part in range(1, MOST * PARTS + 1):
        if PairedRoots(late(answer, of_early, angles, part) - answer).unstable_zeros(1.0):
            return (part - 1) / PARTS
    return float(MOST)


def _first(is_unstable: Callable[[float], bool], sign: float) -> float:
    """Return the distance from one at which the loop becomes unstable [dB]; inf when it does not."""
    for far in np.arange(STEP_DB, FARTHEST_DB + STEP_DB, STEP_DB):
        if is_unstable(sign * float(far)):
            low, high = float(far) - STEP_DB, float(far)
            for _ in range(HALVINGS):
                middle = (low + high) / 2
                low, high = (low, middle) if is_unstable(sign * middle) else (middle, high)
            return high
    return float(np.inf)
