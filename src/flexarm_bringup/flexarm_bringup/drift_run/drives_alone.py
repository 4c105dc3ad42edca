"""Long drills: the rig under plain joint PD on its drives, without estimator, guard and predictive law.

What the watch sees of an arm is the torque that acted and the samples, whoever chose the torque; an hour
takes a few minutes this way. Gains follow the joint law's rule: a third of the slowest mode, damping ratio
0.7.
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
    inertia, omega = np.diag(model.M)[: model.n_theta], BANDWIDTH * float(model.omega[0])
    stiffness, damper = inertia * omega**2, 2 * DAMPING * inertia * omega
    limit = np.array([axis.effort for axis in rig.config.actuated.values()])
    motors = MotorSide(rig.config, rig.dt)
    motors.update(rig.observe())
    for first in range(0, round(end / rig.dt), CHUNK):
        times = np.asarray((first + np.arange(CHUNK)) * rig.dt, dtype=np.float64)
        wanted = reference.sample(times)
        for theta, theta_dot, theta_ddot in zip(*wanted, strict=True):
            tau = stiffness * (theta - motors.theta) + damper * (theta_dot - motors.theta_dot)
            tau = np.clip(tau + inertia * theta_ddot, -limit, limit)
            samples = rig.step(tau)
            motors.update(samples)
            hear(rig, samples, tau)
