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
from flexarm_model.numeric.balance import balance

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
        change = late(answer, of_early, angles, part) - answer
        if PairedRoots(change[may_turn(change)]).unstable_zeros(1.0):
            return (part - 1) / PARTS
    return float(MOST)


def may_turn(matrices: Complex) -> NDArray[np.bool_]:
    """Return at which angles one must look to see how often ``det(1 - matrix)`` turns about zero, (k,).

    Roots of matrices with a norm below one are to the right of zero after all of them are taken from one:
    over a stretch of those they turn by what their first and last tell, however they got there. That leaves
    a part of all angles, and finding roots is what the search takes. Norms depend on the units of each
    torque, roots do not.

    Args:
        matrices: At every angle, (k, n, n).
    """
    sizes: Array = np.abs(matrices)
    _, scale = balance(sizes.max(axis=0))
    sizes *= scale / scale[:, None]
    norms = [np.linalg.norm(sizes, axis=(1, 2)), *(sizes.sum(axis=axis).max(axis=1) for axis in (1, 2))]
    far = np.min(norms, axis=0) >= 1.0  # the largest root is at most as far as any norm tells
    needed = far.copy()
    needed[1:] |= far[:-1]
    needed[:-1] |= far[1:]
    needed[[0, -1]] = True
    return np.asarray(needed, dtype=bool)


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
