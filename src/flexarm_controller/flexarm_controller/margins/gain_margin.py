"""By which factor may the force on one mode be larger or smaller than modelled?

With the force ``f_j`` on mode j times ``g`` and all else as it is, ``z+ = (A + (g - 1) b_j f_j) z`` has an
eigenvalue on the unit circle where ``(g - 1) t_j = 1``, ``t_j`` being the loop's own answer of ``f_j`` to a
force on the mode. The first such ``g`` above and below one are the gain margins of the loop that is broken
at this mode: it is one number for all torques together, so many motors make no difference.

Spill-over through a mode is the product of how strongly it is driven and how strongly it is seen
[Balas1978]; the margin tells how wrong that product may be.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Complex = NDArray[np.complex128]
TINY = 1e-12  # of an answer, below which no factor matters


@dataclass(frozen=True)
class GainMargin:
    """Factors at which the loop becomes unstable.

    Attributes:
        up: Above one; inf when there is none.
        down: Between zero and one; 0 when there is none.
    """

    up: float
    down: float

    @property
    def decibels(self) -> float:
        """The smaller of the two distances from one [dB]."""
        down = -20.0 * np.log10(self.down) if self.down > 0.0 else np.inf
        return float(min(20.0 * np.log10(self.up), down))


def gain_margin(answer: Complex) -> GainMargin:
    """Return the margin from the answer ``t_j`` of a stable loop at angles from 0 to pi, (k,)."""
    imaginary, real = answer.imag.copy(), answer.real
    imaginary[[0, -1]] = 0.0  # there it is real but for rounding
    crossings = [real[imaginary == 0.0]]
    a, b = imaginary[:-1], imaginary[1:]
    k = np.flatnonzero(a * b < 0.0)
    share = a[k] / (a[k] - b[k])
    crossings.append(real[k] + share * (real[k + 1] - real[k]))
    t = np.concatenate(crossings)
    factors = 1.0 + 1.0 / t[abs(t) > TINY]
    above, below = factors[factors > 1.0], factors[(factors > 0.0) & (factors < 1.0)]
    return GainMargin(float(above.min(initial=np.inf)), float(below.max(initial=0.0)))
