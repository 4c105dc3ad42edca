"""Which identified poles are described modes above half the rate, which samples show at another frequency.

Samples at a rate r show a mode of f at ``|f - k r|``, with the decay per second and the shape that it has.
What explains a pole is weighed by what the description may be off by, and all modes by an offset c alike::

    1/2 [(f_i - |f - k r|) / (s_f f)]^2 + 1/2 [ln(decay_i / decay) / s_d]^2 + 1/2 (1 - MAC) / s_phi^2 + ln f

with ``f = f_described exp(c)``. ``ln f`` is the width of the normal distribution: a fast mode may show
anywhere in a wide stretch, so that it explains a pole less well than a mode of the band which is as near.
Every mode explains one pole at most; a pole that none explains within ``REACH`` sigmas is left alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from flexarm_model.modal.read_only import lock_arrays

Array = NDArray[np.float64]
FREQUENCY = 0.03  # one sigma of a described frequency, beside what all are off by [1]
DECAY = 0.7  # the same of ln decay: a factor of two
TURN = 0.5  # the same of the angle between two shapes [rad]
COMMON = 0.15  # the same of what all frequencies are off by [1]
FURTHEST = 0.5  # of ln f: all are not off by more
REACH = 3.0  # sigmas


@dataclass(frozen=True)
class ToldModes:
    """Modes, identified or described.

    Attributes:
        f_hz: Frequencies [Hz], (r,).
        zeta: Damping ratios [1], (r,).
        shapes: At the sensors, of length one, (r, n_out); of no sensor where they are not known.
    """

    f_hz: Array
    zeta: Array
    shapes: Array

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        lock_arrays(self)


def mirror(f_hz: Array, rate_hz: float) -> Array:
    """Return the frequencies at which samples at a rate show modes [Hz]."""
    return np.asarray(abs(f_hz - rate_hz * np.round(f_hz / rate_hz)))


def find_mirrored(found: ToldModes, described: ToldModes, rate_hz: float) -> NDArray[np.intp]:
    """Return which described mode above half the rate every pole is, -1 for none, (r,).

    Args:
        found: The identified poles.
        described: All modes of the description, also those above half the rate, with the same sensors.
        rate_hz: Samples per second [Hz].
    """
    with np.errstate(divide="ignore"):
        shared = np.log(found.f_hz[:, None] / described.f_hz[None, described.f_hz < rate_hz / 2])
    shared = np.append(shared[abs(shared) < FURTHEST], 0.0)
    tried = [_explain(found, described, rate_hz, float(common)) for common in shared]
    return min(tried, key=lambda each: each[0])[1]


def _explain(
    found: ToldModes, described: ToldModes, rate_hz: float, common: float
) -> tuple[float, NDArray[np.intp]]:
    """Return what it costs to explain all poles where all modes are off by ``common``, and the fast modes."""
    f_hz = described.f_hz * np.exp(common)
    cost = _misfit(found, described, f_hz, rate_hz) + np.log(f_hz)
    unexplained = np.full((found.f_hz.size, found.f_hz.size), REACH**2 / 2 + np.log(rate_hz / 2))
    costs = np.hstack([cost, unexplained])
    poles, modes = scipy.optimize.linear_sum_assignment(costs)
    is_fast = np.append(f_hz > rate_hz / 2, np.zeros(found.f_hz.size, bool))
    total = float(costs[poles, modes].sum()) + (common / COMMON) ** 2 / 2
    return total, np.where(is_fast[modes], modes, -1)


def _misfit(found: ToldModes, described: ToldModes, f_hz: Array, rate_hz: float) -> Array:
    """Return half the squares of the sigmas that every pole is off every mode, (r, modes)."""
    tiny = np.finfo(float).tiny
    off = (found.f_hz[:, None] - mirror(f_hz, rate_hz)) / (FREQUENCY * f_hz)
    decays = (np.maximum(modes.zeta * f, tiny) for modes, f in ((found, found.f_hz), (described, f_hz)))
    decay = np.subtract.outer(*(np.log(each) for each in decays)) / DECAY
    unlike = 1.0 - (found.shapes @ described.shapes.T) ** 2 if found.shapes.size else 0.0
    return np.asarray((off**2 + decay**2 + unlike / TURN**2) / 2)
