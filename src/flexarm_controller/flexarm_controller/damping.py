"""Joint damping: brings the axes to rest without knowing anything of the modes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.state import HUGE
from flexarm_model.reduced_model import ReducedModel

Array = NDArray[np.float64]


class JointDamping:
    """``tau = -rate M_tt theta'``, the inertia seen by each axis times a rate."""

    def __init__(self, model: ReducedModel, rate: float) -> None:
        """Take the inertias of ``model``; ``rate`` in 1/s."""
        self._damping = rate * np.diag(model.M)[: model.n_theta]

    def step(self, theta_dot: Array) -> Array:
        """Return the torque against a velocity, (n_u,); none against one that is not finite."""
        return -self._damping * np.where(np.abs(theta_dot) < HUGE, theta_dot, 0.0)
