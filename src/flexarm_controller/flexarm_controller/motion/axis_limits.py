"""Limits of velocity, acceleration and jerk of the axes that follow from torques, strains and served model.

With what a motion asks, ``K theta + D theta' + J theta'' + rest`` (`Demand`), any combination of

    |theta'| <= v,  |theta''| <= a,  |theta'''| <= j

between the poses looked at stays within the limits, because for every motor and every limited gauge

    |K theta + rest| + |D| v + |J| a <= most          |K| v + |D| a + |J| j <= share effort_rate (motors)

A box for all axes at once is careful; ``scale`` widens its accelerations where a motion leaves its corners.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.limits import Limits
from flexarm_controller.motion.demand import Demand, WayDemand, demand_of
from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.motion.settings import MotionConfig
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]
FASTEST = 1e3  # rad/s or m/s, where the description gives no limit
VISCOUS = 0.5  # of a torque or its rate may go into friction and springs; the rest accelerates
NOTHING = 1e-9  # of what is there: less friction is none


@dataclass(frozen=True)
class AxisLimits:
    """Largest magnitudes, each (n_theta,).

    Attributes:
        velocity: [rad/s] or [m/s].
        acceleration: [rad/s^2] or [m/s^2].
        jerk: [rad/s^3] or [m/s^3].
    """

    velocity: Array
    acceleration: Array
    jerk: Array


def axis_limits(
    model: ReducedModel,
    limits: Limits,
    poses: Sequence[Array],
    config: MotionConfig,
    scale: float = 1.0,
    demand: Demand | WayDemand | None = None,
) -> AxisLimits:
    """Return the box for motions of ``model``'s arm among some poses.

    Args:
        model: The served model.
        limits: Of the arm.
        poses: Axes between which the motion stays [rad or m], (n_theta,) each.
        config: Shares of the limits, and the ramp.
        scale: Widens acceleration [1]; the jerk stays within the torque rates.
        demand: Where it is not that of the model.

    Raises:
        MotionError: Holding still at one of the poses takes the torque or strain that there is.
    """
    demand = demand_of(model, limits, config) if demand is None else demand
    standing = abs(demand.standing(np.array(poses))).max(axis=0)
    spare = demand.most - standing
    if (spare <= 0.0).any():
        i = int((spare / demand.most).argmin())
        raise MotionError(
            f"{demand.names[i]}: holding still takes {standing[i]:.4g} of the "
            f"{demand.most[i]:.4g} {demand.units[i]} that motions may need"
        )
    spare = np.maximum(spare, demand.eased * demand.most)
    K, D, J = (abs(part) for part in (demand.K, demand.D, demand.J))
    rate, motors = config.motion_effort * limits.effort_rate, slice(model.n_theta)
    v = config.motion_velocity * np.minimum(limits.velocity, FASTEST)
    v = v * min(1.0, _share(spare, D @ v), _share(rate, K[motors] @ v))
    alike = limits.effort / np.diag(J)  # accelerations that ask the same share of every motor
    box = alike * float(np.min((spare - D @ v) / np.maximum(J @ alike, NOTHING * spare)))
    rate = rate - K[motors] @ v
    box = box * min(1.0, _share(rate, D[motors] @ box))
    a = box * min(scale, _share(rate, D[motors] @ box))
    j = alike * float(np.min((rate - D[motors] @ a) / (J[motors] @ alike)))
    if config.motion_ramp > 0.0 and model.n_eta:
        j = np.minimum(j, box / (config.motion_ramp * 2 * np.pi / model.omega[0]))
    return AxisLimits(v, a, j)


def _share(there: Array, wanted: Array) -> float:
    """Return the factor that brings what friction and springs want down to their part of what is there."""
    there, wanted = there[np.isfinite(there)], wanted[np.isfinite(there)]  # without a limit any factor does
    return VISCOUS * float(np.min(there / np.maximum(wanted, NOTHING * there), initial=np.inf))
