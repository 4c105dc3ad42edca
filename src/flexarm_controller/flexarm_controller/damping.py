"""Joint damping: brings the axes to rest without knowing anything of the modes, and carries the load."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.joint_loop import GAIN_MARGIN, JointLoop
from flexarm_controller.program.equilibrium import build_equilibrium
from flexarm_controller.state import HUGE
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]
LOWER = 0.8  # factor between two tries
SMALLEST = 1e-3  # 1/s
LOAD_OFF = 0.1  # share of the load that may be another than described: a payload, a cable
AWAY = 0.1  # rad or m that the arm may be away from the pose of the load


class JointDamping:
    """``tau = tau_0 - rate M_tt theta'``: the inertia seen by each axis times a rate.

    ``tau_0`` holds weight and springs at the pose of the model, whatever becomes of the state. The rate is
    lowered until the loop would bear twice of it, with its delay and with the modes of the served model: a
    light motor on a heavy link would shake them.

    Attributes:
        load: ``tau_0``, (n_u,).
        rate: In use [1/s].
    """

    def __init__(self, model: ReducedModel, rate: float, period: float, delay: int) -> None:
        """Take load and inertias of ``model``.

        Args:
            model: The served model.
            rate: That is wanted [1/s].
            period: Of control [s].
            delay: Periods from a state to the torque computed from it.
        """
        rest, loop = build_equilibrium(model), JointLoop(model, period, delay)
        n = model.n_theta
        inertia = np.diag(model.M)[:n]
        while loop.rings(GAIN_MARGIN * rate * inertia) and rate > SMALLEST:
            rate *= LOWER
        self.rate, self._damping = rate, rate * inertia
        self.load = rest.U[:, :n] @ model.pose + rest.u_0
        self._off = LOAD_OFF * abs(self.load) + AWAY * abs(rest.U[:, :n]).sum(axis=1)

    def lets_sink(self, rest_velocity: float) -> bool:
        """Return whether an axis would move faster than at rest [rad/s] or [m/s] with a load that is off."""
        return bool((self._off > self._damping * rest_velocity).any())

    def step(self, theta_dot: Array) -> Array:
        """Return the torque against a velocity, (n_u,); the load alone where it is not finite."""
        return self.load - self._damping * np.where(np.abs(theta_dot) < HUGE, theta_dot, 0.0)
