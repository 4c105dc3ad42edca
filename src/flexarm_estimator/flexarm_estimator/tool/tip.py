"""The tool point as a function of the state.

``cov(pose) = J P_xi J'``, ``cov(twist) = J P_xi' J'`` with the tip's Jacobian J [linear; angular] in
world axes; the change of J with the state is of second order and left out.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filter import Belief
from flexarm_estimator.tool.rotation_log import relative_rotation
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.borne_load import BorneLoad
from flexarm_model.tree.closure_error import ClosureError

Array = NDArray[np.float64]


class Kinematics(Protocol):
    """Pose and Jacobian of the tip, mass and springs of the arm, in the coordinates of the dynamics tree."""

    def tip_pose(self, q: Array) -> Array:
        """Return T_world_tip, (4, 4)."""
        ...

    def tip_jacobian(self, q: Array) -> Array:
        """Return the Jacobian [linear; angular] in world axes, (6, n_q)."""
        ...

    def mass_matrix(self, q: Array) -> Array:
        """Return M(q), (n_q, n_q)."""
        ...

    def borne(self, q: Array) -> BorneLoad:
        """Return what springs and bodies bear at rest at q."""
        ...


class TipReport(NamedTuple):  # not a dataclass: made in every step, at a quarter of the cost
    """The tip at one instant; arrays are read-only.

    Attributes:
        T_world_tip: Pose, (4, 4).
        twist: [linear; angular] in world axes, (6,).
        cov_pose: Of position and rotation vector, world axes, (6, 6).
        cov_twist: Of the twist, (6, 6).
        sigma: One sigma of the position, all directions together [m]; NaN where anything else is.
        x, P: Mean (n_x,) and covariance (n_x, n_x) of the state that it was seen from, copied.
    """

    T_world_tip: Array
    twist: Array
    cov_pose: Array
    cov_twist: Array
    sigma: float
    x: Array
    P: Array


class Tip(ABC):
    """Pose and Jacobian at ``x``, with ``q = q0 + Phi (xi - xi0)``; x starts with xi and xi', (n,) each."""

    @abstractmethod
    def pose(self, x: Array) -> Array:
        """Return T_world_tip, (4, 4).

        Raises:
            ClosureError: The loops do not close at this state.
        """

    @abstractmethod
    def locate(self, x: Array) -> tuple[Array, Array]:
        """Return the pose and the Jacobian [linear; angular] in world axes by xi, (6, n).

        Raises:
            ClosureError: The loops do not close at this state.
        """

    def compare(self, y: Array, x: Array) -> tuple[Array, Array]:
        """Return how far a measured pose is from that at ``x``, and the Jacobian there.

        Args:
            y: Position and rotation vector, (6,).
            x: State, (n_x,).

        Returns:
            Innovation ``[p - p(x); log(R R(x)')]``, (6,), and the Jacobian [linear; angular] by xi, (6, n).

        Raises:
            ClosureError: The loops do not close at this state.
        """
        T, J = self.locate(x)
        return pose_difference(y, T), J

    @abstractmethod
    def describe(self, belief: Belief) -> TipReport:
        """Return the tip's pose, twist and covariances; NaN where the loops do not close at this state."""

    def sight(self, gain: Array, constant: Array) -> Sight:
        """Return the tip as a function of some numbers y, at ``x = gain y + constant``.

        Args:
            gain: (n_x, m).
            constant: (n_x,).
        """
        return Sight(self, gain, constant)


class Sight:
    """The tip as a function of numbers y, at ``x = gain y + constant``."""

    def __init__(self, tip: Tip, gain: Array, constant: Array) -> None:
        """Bind the tip to gain (n_x, m) and constant (n_x,)."""
        self._tip, self._gain, self._constant = tip, gain, constant

    def position(self, y: list[float]) -> Array:
        """Return the position of the tip [m], (3,), where the numbers are ``y`` (m,).

        Raises:
            ClosureError: The loops do not close there.
        """
        return self._tip.pose(self._gain.dot(y) + self._constant)[:3, 3]


class PlainTip(Tip):
    """With NumPy."""

    def __init__(self, model: ReducedModel, kinematics: Kinematics) -> None:
        """Bind the kinematics to a served model."""
        self._kinematics = kinematics
        self._Phi = np.array(model.Phi)
        self._q_origin = model.q0 - self._Phi @ model.xi0
        self._n = model.n

    def pose(self, x: Array) -> Array:
        """See Tip."""
        return self._kinematics.tip_pose(self._coordinates(x))

    def locate(self, x: Array) -> tuple[Array, Array]:
        """See Tip."""
        q = self._coordinates(x)
        return self._kinematics.tip_pose(q), self._kinematics.tip_jacobian(q).dot(self._Phi)

    def describe(self, belief: Belief) -> TipReport:
        """See Tip."""
        (x, P), n = belief, self._n
        try:
            T, J = self.locate(x)  # (4, 4), (6, n)
        except ClosureError:
            T, J = np.full((4, 4), np.nan), np.full((6, n), np.nan)
        twist, cov_pose = J.dot(x[n : 2 * n]), J.dot(P[:n, :n]).dot(J.T)
        cov_twist = J.dot(P[n : 2 * n, n : 2 * n]).dot(J.T)
        parts = (T.ravel(), twist, cov_pose.diagonal(), cov_twist.diagonal())
        is_finite = math.isfinite(sum([sum(part.tolist()) for part in parts]))
        variance = float(cov_pose.diagonal()[:3].sum()) if is_finite else math.nan
        arrays = T, twist, cov_pose, cov_twist, x.copy(), P.copy()
        for array in arrays:
            array.setflags(write=False)
        return TipReport(*arrays[:4], spread(variance), *arrays[4:])

    def _coordinates(self, x: Array) -> Array:
        q: Array = self._q_origin + self._Phi.dot(x[: self._n])
        return q


def pose_difference(y: Array, T: Array) -> Array:
    """Return position [m] and rotation [rad] from a pose T (4, 4) to one measured as ``y`` (6,), (6,)."""
    nu = np.empty(6)
    nu[:3], nu[3:] = y[:3] - T[:3, 3], relative_rotation(y[3:], T[:3, :3])
    return nu


def spread(variance: float) -> float:
    """Return one sigma of a variance that rounding may have made negative; NaN stays."""
    return math.sqrt(variance) if variance > 0.0 else 0.0 * variance
