"""What the estimator says after every step: state, tip, covariances, and whether to trust them."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.state.state_layout import StateLayout

Array = NDArray[np.float64]
Status = Literal["ok", "degraded", "lost", "starting"]
SensorStatus = Literal["ok", "stale", "rejected", "off", "faulty"]


class SensorReport(NamedTuple):  # not a dataclass: four are made in every step, at a fifth of the cost
    """Health of one sensor.

    Attributes:
        name: Name of the sensor.
        status: "ok" (fused), "stale" (silent), "rejected" (last sample refused), "off" (by hand),
            "faulty" (found out by a watch, not used).
        reason: Why it is not "ok"; empty when it is.
        age: Time since the stamp of the newest accepted sample, or since the start [s].
        accepted: Samples fused since the estimator was made; a reset counts on.
        rejected: Samples refused since then.
        innovation: Measured minus predicted of the newest sample that could be compared, SI, (m,).
        normalised: ``sqrt(nu' S^-1 nu / m)`` of the same sample [1].
    """

    name: str
    status: SensorStatus
    reason: str
    age: float
    accepted: int
    rejected: int
    innovation: Array
    normalised: float


class Estimate(NamedTuple):  # not a dataclass: made in every step, at a third of the cost
    """State of the arm at ``t`` given everything that has arrived; its arrays are read-only.

    Attributes:
        t: Instant [s].
        model_id: Model that defines the modes.
        x: State [theta; eta; theta'; eta'; d; b; w; s; p], SI, (n_x,).
        P: Its covariance, (n_x, n_x).
        layout: Where things stand in x.
        status: May it be used? "ok" and "degraded" yes, "lost" and "starting" no.
        reason: Why it is not "ok"; empty when it is.
        sensors: Health of every sensor.
        age: Time since the estimator began, or began anew: start, reset, jump of the clock [s].
        T_world_tip: Pose of the tip, (4, 4).
        twist_tip: Its velocity [linear; angular] in world axes [m/s, rad/s], (6,).
        cov_tip_pose: Covariance of position and rotation vector, world axes, (6, 6).
        cov_tip_twist: Covariance of the twist, world axes, (6, 6).
    """

    t: float
    model_id: str
    x: Array
    P: Array
    layout: StateLayout
    status: Status
    reason: str
    sensors: tuple[SensorReport, ...]
    age: float
    T_world_tip: Array
    twist_tip: Array
    cov_tip_pose: Array
    cov_tip_twist: Array

    @property
    def is_usable(self) -> bool:
        """Whether a law may act on it."""
        return self.status in ("ok", "degraded")

    @property
    def n(self) -> int:
        """Number of served coordinates theta and eta."""
        return self.layout.n

    @property
    def n_d(self) -> int:
        """Number of unmodelled torques d, equal to the number of actuated axes."""
        return self.layout.n_theta

    @property
    def theta(self) -> Array:
        """Actuated axes [rad] or [m], (n_theta,)."""
        return self.x[self.layout.theta]

    @property
    def eta(self) -> Array:
        """Modal displacements [kg^0.5 m], (n_eta,)."""
        return self.x[self.layout.eta]

    @property
    def theta_dot(self) -> Array:
        """Velocities of the actuated axes [rad/s] or [m/s], (n_theta,)."""
        return self.x[self.layout.theta_dot]

    @property
    def eta_dot(self) -> Array:
        """Modal velocities [kg^0.5 m/s], (n_eta,)."""
        return self.x[self.layout.eta_dot]

    @property
    def d(self) -> Array:
        """Unmodelled torques on the actuated axes [N m] or [N], (n_theta,)."""
        return self.x[self.layout.d]

    @property
    def b(self) -> Array:
        """Biases of the sensors ``layout.biases``, SI of their channel, (n_b,)."""
        return self.x[self.layout.b]

    @property
    def stiffness(self) -> Array:
        """Learned relative error of the stiffness of the slowest modes [1], (n_learned,)."""
        return self.x[self.layout.p].repeat(self.layout.n_learned)
