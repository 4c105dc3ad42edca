"""By how much may the force on one mode be later than modelled?

The force ``f_j`` reaches mode j late by ``m + k / PARTS`` periods, all else is as it is. The force is held
over periods, so a part of a period brings in the value of the period before; that is exact, also for modes
faster than half the control rate. With the loop's own answer to the force on time, and to what the first
parts of a period do of it::

    w = 1 - (late - on time)        late = z^-m (on time + (z^-1 - 1) early_k)

The zeros of ``w`` are the eigenvalues of the late loop, its poles those of the loop on time, which is stable.
By Nyquist's criterion [Nyquist1932] the late loop has as many unstable eigenvalues as w turns about zero
while z goes round the unit circle. The margin is the largest delay up to which w does not turn.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.margins.full_plant import PARTS

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
MOST = 4  # periods that are looked at


def delay_margin(answer: Complex, of_early: Complex, angles: Array) -> float:
    """Return the margin in periods, at most ``MOST``; it is told to a part of a period.

    Args:
        answer: Of ``f_j`` to a force held over the period, felt by the sensors at its end, (k,).
        of_early: To what of that force is due to the first parts of the period, (PARTS + 1, k).
        angles: From 0 to pi [rad], (k,).
    """
    if (2.0 * (abs(answer) + abs(of_early).max(axis=0))).max() < 1.0:  # w cannot reach zero, however late
        return float(MOST)
    for part in range(1, MOST * PARTS + 1):
        if unstable_zeros(1.0 - late(answer, of_early, angles, part) + answer):
            return (part - 1) / PARTS
    return float(MOST)


def late(answer: Complex, of_early: Complex, angles: Array, part: int) -> Complex:
    """Return the answer to what comes ``part`` parts of a period late; shapes as given, angles first."""
    periods, rest = divmod(part, PARTS)
    z = np.exp(1j * angles).reshape(-1, *(1,) * (answer.ndim - 1))
    return np.asarray(z**-periods * (answer + (1.0 / z - 1.0) * of_early[rest]))


def unstable_zeros(w: Complex) -> int:
    """Return how many zeros outside the unit circle the turns of ``w`` tell, at angles from 0 to pi."""
    turned = np.angle(w[1:] / w[:-1]).sum()
    return -round(float(turned) / np.pi)
