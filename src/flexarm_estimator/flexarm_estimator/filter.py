"""The Kalman filter: filterpy's, wrapped so that it is exact, symmetric and never sees rubbish.

Prediction ``P = A P A' + Q``; update with process and measurement noise correlated by ``M``::

    S = H P H' + H M + M' H' + R      K = (P H' + M) S^-1      x = x + K nu
    P = (I - K H) P (I - K H)' + K R K' - (I - K H) M K' - K M' (I - K H)'     (Joseph)

filterpy's own correlated update is not in Joseph form; its gain is used, its covariance is not. A
result that is not finite is dropped: the belief before it is returned.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dposv

from flexarm_estimator.state.process import Transition

if TYPE_CHECKING:
    from filterpy.kalman import KalmanFilter

Array = NDArray[np.float64]


class Belief(NamedTuple):
    """Mean and covariance of the state.

    Attributes:
        x: (n_x,).
        P: (n_x, n_x).
    """

    x: Array
    P: Array

    @property
    def is_finite(self) -> bool:
        """No entry is NaN, infinite, or too large to be squared."""
        flat = self.P.ravel()
        with np.errstate(over="ignore"):
            return math.isfinite(self.x.dot(self.x) + flat.dot(flat))


class GuardedFilter:
    """Predict and update beliefs; keeps no state between calls."""

    def __init__(self, n_x: int, n_u: int) -> None:
        """Make the filter for ``n_x`` states and ``n_u`` inputs."""
        self._n_x, self._n_u = n_x, n_u

    @cached_property
    def _filter(self) -> KalmanFilter:
        """The filter of filterpy; it loads all of scipy.stats, and the joint step in C does without it."""
        from filterpy.kalman import KalmanFilter

        return KalmanFilter(dim_x=self._n_x, dim_z=1, dim_u=self._n_u)

    def predict(self, belief: Belief, transition: Transition, u: Array) -> Belief:
        """Return the belief one step later; ``u = [tau; 1]``, (n_u + 1,), is held over the step."""
        kalman = self._filter
        kalman.x, kalman.P = belief.x, belief.P
        kalman.predict(u, B=transition.B, F=transition.A, Q=transition.Q)
        moved = Belief(kalman.x, (kalman.P + kalman.P.T) * 0.5)
        return moved if moved.is_finite else belief

    def update(self, belief: Belief, nu: Array, H: Array, R: Array, M: Array | None = None) -> Belief:
        """Return the belief after a measurement.

        Args:
            belief: Before it.
            nu: Innovation, (m,).
            H: Jacobian, (m, n_x).
            R: Noise covariance, (m, m).
            M: Covariance of the noise with the process noise in ``belief``, (n_x, m).
        """
        kalman = self._filter
        kalman.x, kalman.P = belief.x, belief.P
        try:
            if M is None:
                kalman.update(nu + H.dot(belief.x), R=R, H=H)
                P = kalman.P
            else:
                kalman.M = M
                kalman.update_correlated(nu + H.dot(belief.x), R=R, H=H)
                P = _joseph(belief.P, kalman.K, H, R, M)
        except np.linalg.LinAlgError:  # S is singular: nothing can be learnt from this sample
            return belief
        updated = Belief(kalman.x, (P + P.T) * 0.5)
        return updated if updated.is_finite else belief


def predict(belief: Belief, transition: Transition, u: Array) -> Belief:
    """Return ``A x + B u`` and ``A P A' + Q``, unguarded; ``u = [tau; 1]``, (n_u + 1,), is held."""
    A = transition.A
    P = A.dot(belief.P).dot(A.T) + transition.Q
    return Belief(A.dot(belief.x) + transition.B.dot(u), (P + P.T) * 0.5)


def _joseph(P: Array, K: Array, H: Array, R: Array, M: Array) -> Array:
    left = np.eye(P.shape[0]) - K.dot(H)
    mixed = left.dot(M).dot(K.T)
    updated: Array = left.dot(P).dot(left.T) + K.dot(R).dot(K.T) - mixed - mixed.T
    return updated


def innovation_covariance(P: Array, H: Array, R: Array, M: Array | None = None) -> Array:
    """Return ``S = H P H' + H M + M' H' + R``, (m, m)."""
    S: Array = H.dot(P).dot(H.T) + R
    if M is None:
        return S
    mixed = H.dot(M)
    S += mixed + mixed.T
    return S


def normalised_square(nu: Array, S: Array) -> float:
    """Return ``nu' S^-1 nu`` [1] of nu (m,) and S (m, m); infinite when S is not positive definite."""
    if nu.size == 1:
        value, variance = float(nu[0]), float(S[0, 0])
        return value * value / variance if variance > 0.0 else math.inf  # ** raises when it overflows
    _, solution, info = dposv(S, nu)
    return float(nu.dot(solution)) if info == 0 else math.inf
