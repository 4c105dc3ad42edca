"""Coulomb friction with a steep slope through zero instead of a jump, ``F(v) = F_c tanh(v / s)``.

An implicit step takes it as ``force + rise dv`` and is right as long as that works against the motion. Three
grips do it, each where the one before would push the axis in some step, as a force does that is still that
of the step's begin when the axis has turned round::

    TANGENT   F(v) + F'(v) dv / 2       exact to first order, of second order while an axis slides
    END       k (v + dv)                k = F(v) / v: an axis that comes to rest stands
    MIDDLE    k (v + dv / 2)            its power is -k times the square of the mean velocity: it cannot push
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FRICTION_SLOPE = 0.01  # velocity over which Coulomb friction turns its sign [rad/s or m/s]
TANGENT, END, MIDDLE = range(3)


def friction_over_step(level: float, v: Array, grip: NDArray[np.int64]) -> tuple[Array, Array]:
    """Return the force against the motion over a step, and how it rises with the change of velocity.

    Args:
        level: Force of full friction [N m or N].
        v: Velocities at its begin [rad/s or m/s], (n,).
        grip: How that of every axis is taken, (n,).
    """
    ramp = np.tanh(v / FRICTION_SLOPE)
    chord = level * np.divide(ramp, v, out=np.full_like(v, 1.0 / FRICTION_SLOPE), where=v != 0.0)
    tangent = level * (1 - ramp**2) / FRICTION_SLOPE / 2
    rise = np.choose(grip, (tangent, chord, chord / 2))
    return level * ramp, rise


def tighten(grip: NDArray[np.int64], force: Array, rise: Array, v: Array, dv: Array) -> bool:
    """Take another grip where friction would push over a step, in place; return whether it did anywhere.

    Args:
        grip: Of every axis, (n,).
        force: See ``friction_over_step``, (n,).
        rise: Likewise, (n,).
        v: Velocities at the begin of the step, (n,).
        dv: Their change, (n,).
    """
    pushes = ((force + rise * dv) * (v + dv / 2) < 0.0) & (grip < MIDDLE)
    grip += pushes
    return bool(pushes.any())
