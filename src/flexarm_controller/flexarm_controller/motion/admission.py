"""References from outside: followed, stretched in time, or refused, with what the arm cannot do of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.limits import Limits
from flexarm_controller.motion.excess import find_excess
from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.motion.settings import MotionConfig
from flexarm_controller.motion.stretch import stretch
from flexarm_controller.program.equilibrium import build_equilibrium
from flexarm_controller.reference import Reference
from flexarm_model.reduced_model import ReducedModel

Array = NDArray[np.float64]


def admit(
    reference: Reference, model: ReducedModel, limits: Limits, config: MotionConfig
) -> tuple[Reference, str]:
    """Return what is to be followed, and a remark where that is not simply the reference.

    Args:
        reference: Asked for.
        model: The served model, for its torque.
        limits: Of the arm.
        config: What becomes of a reference that is too fast.

    Raises:
        MotionError: It is outside the limits; names axis, quantity, value, limit and instant.
    """
    if reference.theta.shape[1] != limits.effort.size:
        raise MotionError(reference.fault(limits))
    equilibrium, names = build_equilibrium(model), model.theta_names
    excess = find_excess(reference, limits, names, equilibrium)
    if excess is None:
        return reference, ""
    if config.excess == "stretch":
        slowed, factor = stretch(reference, limits, names, equilibrium)
        return slowed, f"stretched in time by {factor:.4g}: {excess}"
    if excess.quantity == "torque" and config.excess == "tell":
        return reference, f"the arm will lag: {excess}"
    raise MotionError(str(excess))


def check_jump(reference: Reference, before: Array, t: float, limits: Limits, period: float) -> None:
    """Check that a reference takes over where the axes are to be.

    Args:
        reference: Asked for.
        before: Where the axes are to be at ``t`` without it [rad or m], (n_theta,).
        t: When it takes over [s].
        limits: Of the arm.
        period: In which the axes may move at their velocity limit [s].

    Raises:
        MotionError: It jumps; names axis, both positions and what is allowed.
    """
    there = reference.position(t)
    jump = abs(there - before) / np.maximum(limits.velocity * period, np.finfo(float).tiny)
    i = int(jump.argmax())
    if jump[i] > 1.0:
        allowed = limits.velocity[i] * period
        raise MotionError(
            f"axis {i + 1}: it jumps from {before[i]:.4g} to {there[i]:.4g} at {t:.3f} s; "
            f"at most {allowed:.3g}, the velocity limit times the period, is allowed"
        )
