"""Springs that are others than those of the arm's description: the served model has them, the motion has not.

A served model may be made for another pressure or temperature. What its springs and dampers differ by is
linear in q and v, so a force on xi that the model itself tells, beside the motion's own tangent at rest
(index a)::

    M xi'' + f(xi, xi') = B tau - [f0 - f0_a + (K - K_a) (xi - xi0) + (D - D_a) xi']

Exact where no loop closes, as the shapes do not change there, and else of first order about the pose.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filters.moving_arm import MovingArm
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]
_ROUNDING = 1e-8  # of the largest value of its kind: smaller differences are the way it was computed


class SpringForce(NamedTuple):
    """Force on xi beyond that of the motion.

    Attributes:
        slope: By [xi; xi'], (n, 2 n).
        constant: Where both are zero, (n,).
    """

    slope: Array
    constant: Array


def spring_force(arm: MovingArm, model: ReducedModel) -> SpringForce:
    """Return what the springs of a served model do beyond those of the arm; nothing where they are its own.

    Args:
        arm: The motion about the model's operating point.
        model: The served model.
    """
    n, still = model.n, np.zeros(model.n)
    borne = -model.M @ arm.at(model.xi0, still, still).xi_ddot
    own = -model.M @ arm.slopes(arm.at(model.xi0, still, borne)).accel
    dK, dD = (
        _beyond(served, part)
        for served, part in zip((model.K, model.D), (own[:, :n], own[:, n:]), strict=True)
    )
    df = _beyond(model.f0, borne)
    return SpringForce(-np.hstack([dK, dD]), dK @ model.xi0 - df)


def _beyond(served: Array, own: Array) -> Array:
    """Return the difference, zeros where all of it is rounding."""
    difference = served - own
    most = max(float(abs(served).max()), float(abs(own).max()))
    return difference if abs(difference).max() > _ROUNDING * most else np.zeros_like(difference)
