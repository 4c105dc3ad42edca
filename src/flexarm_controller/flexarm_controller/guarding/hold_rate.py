"""How stiffly an elastic arm may be held through its motors: the stability of the sampled loop.

The guard holds with ``tau = h + S theta - M_tt (r w + r^2 / 4 theta)`` once a period, where ``h + S theta``
is what the weight asks, theta counts from where it holds, and w is the velocity as the drives tell it,

    w_k = (1 - s) w_k-1 + s (theta_k - theta_k-1) / T

What it knows is a period old when its torque begins to act. On a rigid arm r could be about 1 / 4 T. A motor
in front of an elastic arm feels less inertia at once than in the end, and beyond some r the loop of both
rings up by itself. The poles of the whole loop, ``x_k+1 = exp(A T) x_k + ..``, tell where. They are others at
another pose: a 3RRR that is held with the rate of its home tears its loops apart at some.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.guarding.plausibility import VELOCITY_SMOOTHING
from flexarm_controller.program.equilibrium import build_equilibrium
from flexarm_model.numeric.dense import expm
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]
FINENESS = 0.95  # of the search, downwards from 1 / T
COARSENESS = 0.7  # of that from home downwards, which is made while the arm moves
LOWEST = 1e-5  # of 1 / T


@dataclass(frozen=True)
class HoldRate:
    """Rate that an arm is held with, wherever it is.

    Attributes:
        dt: Motor period [s].
        gain: Of the rate over the one with which the arm would ring up.
        most: At home [1/s].
        smoothing: s of the module [1].
    """

    dt: float
    gain: float
    most: float
    smoothing: float = VELOCITY_SMOOTHING

    def at(self, model: ReducedModel) -> float:
        """Return the rate at the pose of a model, at most that at home [1/s]."""
        free = self.most / self.gain
        return self.gain * largest_hold_rate(model, self.dt, self.smoothing, free, COARSENESS)


def largest_hold_rate(
    model: ReducedModel,
    dt: float,
    smoothing: float = VELOCITY_SMOOTHING,
    most: float | None = None,
    fineness: float = FINENESS,
) -> float:
    """Return the largest r [1/s] with which the loop is stable.

    Args:
        model: The arm.
        dt: Motor period [s].
        smoothing: s of the module [1].
        most: Where to begin [1/s]; by itself 1 / dt.
        fineness: Factor from one try to the next, downwards [1].
    """
    rate = 1.0 / dt if most is None else most
    while rate > LOWEST / dt and spectral_radius(model, dt, rate, smoothing) >= 1.0:
        rate *= fineness
    return rate


def spectral_radius(
    model: ReducedModel, dt: float, rate: float, smoothing: float = VELOCITY_SMOOTHING
) -> float:
    """Return the largest magnitude of a pole of the arm held with r = ``rate`` [1/s]."""
    m, (step, push) = model.n_theta, _sampled(model, dt)
    n_x = len(step)
    now = np.eye(m, n_x)
    velocity = np.hstack([smoothing * now, -smoothing * np.eye(m), (1.0 - smoothing) * np.eye(m)]) / dt
    velocity[:, n_x + m :] *= dt  # of what is remembered
    pull = rate * model.M[:m, :m] @ velocity
    pull[:, :m] += rate**2 / 4.0 * model.M[:m, :m] - build_equilibrium(model).U[:, :m]
    loop = np.zeros((n_x + 3 * m, n_x + 3 * m))  # of x, theta before, w, and -tau of the next period
    loop[:n_x, :n_x], loop[:n_x, n_x + 2 * m :] = step, -push
    loop[n_x : n_x + m, :n_x] = now
    loop[n_x + m : n_x + 2 * m, : n_x + 2 * m] = velocity
    loop[n_x + 2 * m :, : n_x + 2 * m] = pull
    return float(abs(np.linalg.eigvals(loop)).max())


def _sampled(model: ReducedModel, dt: float) -> tuple[Array, Array]:
    """Return how the state goes on over a period, (n_x, n_x), and by torque, (n_x, n_theta)."""
    n, m = model.n, model.n_theta
    block = np.zeros((2 * n + m, 2 * n + m))
    block[:n, n : 2 * n] = np.eye(n)
    block[n : 2 * n] = np.linalg.solve(model.M, np.hstack([-model.K, -model.D, model.B]))
    sampled = expm(block * dt)
    return sampled[: 2 * n, : 2 * n], sampled[: 2 * n, 2 * n :]
