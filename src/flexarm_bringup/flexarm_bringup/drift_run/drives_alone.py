"""Long drills: the rig under plain joint PD on its drives, without estimator, guard and predictive law.

What the watch sees of an arm is the torque that acted and the samples, whoever chose the torque; an hour
takes a few minutes this way. Gains follow the joint law's rule: a third of the slowest mode, damping ratio
0.7, and no faster than the period can follow, which is all that bounds a rigid arm.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.sim.motor_side import MotorSide
from flexarm_bringup.sim.rig import Rig
from flexarm_bringup.sim.sample import Sample
from flexarm_controller.reference import Reference
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]
BANDWIDTH, DAMPING = 1.0 / 3.0, 0.7  # of the slowest mode; ratio
FASTEST = 0.25  # of the joint loop [rad per period]
CHUNK = 2000  # periods whose reference is sampled at once

Hear = Callable[[Rig, list[Sample], Array], None]
"""Is told the rig, the samples of its tick and the torque that acted until then."""


def drive_alone(rig: Rig, model: ReducedModel, reference: Reference, end: float, hear: Hear) -> None:
    """Follow a reference.

    Args:
        rig: At tick 0.
        model: Served at the start; gives inertia and slowest mode.
        reference: Of the axes.
        end: When to stop [s].
        hear: Is told every tick.
    """
    inertia, omega = np.diag(model.M)[: model.n_theta], BANDWIDTH * slowest(model, rig.dt)
    stiffness, damper = inertia * omega**2, 2 * DAMPING * inertia * omega
    limit = np.array([axis.effort for axis in rig.config.actuated.values()])
    motors = MotorSide(rig.config, rig.dt)
    motors.update(rig.observe())
    periods = round(end / rig.dt)
    for first in range(0, periods, CHUNK):
        times = np.asarray(np.arange(first, min(first + CHUNK, periods)) * rig.dt, dtype=np.float64)
        wanted = reference.sample(times)
        for theta, theta_dot, theta_ddot in zip(*wanted, strict=True):
            tau = stiffness * (theta - motors.theta) + damper * (theta_dot - motors.theta_dot)
            tau = np.clip(tau + inertia * theta_ddot, -limit, limit)
            samples = rig.step(tau)
            motors.update(samples)
            hear(rig, samples, tau)


def slowest(model: ReducedModel, dt: float) -> float:
    """Return the frequency that joint loops and motions keep below [rad/s]: the slowest mode, if it is slow.

    Args:
        model: Served; perhaps without a mode.
        dt: Period [s].
    """
    followed = FASTEST / (BANDWIDTH * dt)
    return min(float(model.omega[0]), followed) if model.n_eta else followed
