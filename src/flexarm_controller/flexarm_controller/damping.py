"""Joint damping: brings the axes to rest without knowing anything of the modes, and carries the load."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.program.equilibrium import build_equilibrium
from flexarm_controller.state import HUGE
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]


class JointDamping:
    """``tau = tau_0 - rate M_tt theta'``: the inertia seen by each axis times a rate.

    ``tau_0`` holds weight and springs at the pose of the model, whatever becomes of the state.

    Attributes:
        load: ``tau_0``, (n_u,).
    """

    def __init__(self, model: ReducedModel, rate: float) -> None:
        """Take load and inertias of ``model``; ``rate`` in 1/s."""
        rest = build_equilibrium(model)
        n = model.n_theta
        self._damping = rate * np.diag(model.M)[:n]
        self.load = rest.U[:, :n] @ model.pose + rest.u_0

    def step(self, theta_dot: Array) -> Array:
        """Return the torque against a velocity, (n_u,); the load alone where it is not finite."""
        return self.load - self._damping * np.where(np.abs(theta_dot) < HUGE, theta_dot, 0.0)
