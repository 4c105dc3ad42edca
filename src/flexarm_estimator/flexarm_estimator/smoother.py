"""Fixed-lag smoother for recorded data: every state given also what was sampled up to a lag later.

The noise of the rows at k+1 is correlated with the process noise that leads there (accelerometers feel the
forces that move the arm), so ``y_k+1`` says something of ``x_k`` that ``x_k+1`` does not: the recursion of
the textbooks [Rauch1965] is not exact. But given ``x_k+1`` and ``y_k+1``, nothing later says more of ``x_k``.
With the Cholesky factor of the joint covariance of ``[y_k+1; x_k+1; x_k]`` given all up to k::

    L = [L_y 0 0; L_+y L_+ 0; L_ky L_k+ L_k]         Gamma = L_k+ L_+^-1
    x_k|K = x_k|k + L_ky L_y^-1 nu + Gamma (x_k+1|K - x_k+1|k+1)      P_k|K = L_k L_k' + Gamma P_k+1|K Gamma'

where ``x_k+1|k+1`` is given the rows alone: a pose of the same instant depends on ``x_k+1`` only.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.linalg.lapack import dpotrf

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.filter import Belief
from flexarm_estimator.fusion import Fusion
from flexarm_estimator.history import SAME_INSTANT, Instant
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.parts import Parts

Array = NDArray[np.float64]


class Smoothed(NamedTuple):
    """A state given also what came later.

    Attributes:
        t: Instant [s].
        belief: Mean and covariance.
        parts: Of the served model whose coordinates they are in.
    """

    t: float
    belief: Belief
    parts: Parts


class BackwardStep(NamedTuple):
    """The state at one instant given that at the next: ``x_k = gain x_k+1 + constant + v``.

    Attributes:
        gain: (n_x, n_x).
        constant: (n_x,).
        rest: Covariance of v, (n_x, n_x).
    """

    gain: Array
    constant: Array
    rest: Array

    def apply(self, later: Belief) -> Belief:
        """Return the belief at the earlier instant."""
        P = self.gain.dot(later.P).dot(self.gain.T) + self.rest
        return Belief(self.gain.dot(later.x) + self.constant, (P + P.T) * 0.5)


def smooth(fusion: Fusion, instants: Sequence[Instant]) -> list[Belief]:
    """Return the belief of every instant given the samples of all of them.

    Args:
        fusion: Filter that computed them.
        instants: In order of time, computed.
    """
    x, P = instants[-1].belief
    beliefs = [Belief(x.copy(), P.copy())]
    for before, instant in zip(instants[-2::-1], instants[:0:-1], strict=True):
        beliefs.append(backward_step(fusion, before.belief, before.t, instant).apply(beliefs[-1]))
    return beliefs[::-1]


def backward_step(fusion: Fusion, before: Belief, t: float, instant: Instant) -> BackwardStep:
    """Return how the state ``before`` [s] ``t`` follows from that of the next instant.

    Args:
        fusion: Filter that computed both.
        before: Belief at the earlier instant given what was sampled until then.
        t: The earlier instant [s].
        instant: The later one.
    """
    step = fusion.prepare(before, instant.t - t, instant)
    mean, J = step.predict(before)
    m, n = step.y.size, before.x.size
    reach = step.rows_by_state(before)  # (m + n, n)
    nu = step.y - mean[:m]
    joint = np.empty((m + 2 * n, m + 2 * n))
    joint[: m + n, : m + n] = J[:-1, :-1]
    if instant.reopening is not None:
        felt = np.eye(n) if step.stack is None else np.vstack([step.stack.C, np.eye(n)])
        joint[: m + n, : m + n] += felt.dot(fusion.widen(instant.reopening)).dot(felt.T)
    joint[m + n :, : m + n] = reach.dot(before.P).T
    joint[m + n :, m + n :] = before.P
    scale = np.sqrt(np.maximum(joint.diagonal(), 1e-300))
    L, info = dpotrf(joint / np.outer(scale, scale), lower=1, clean=1)
    if info != 0:  # rounding: what came later is left out
        return BackwardStep(np.zeros((n, n)), before.x, before.P)
    L *= scale[:, None]
    known = solve_triangular(L[:m, :m], nu, lower=True) if m else nu
    L_next, L_gain, L_rest = L[m : m + n, m : m + n], L[m + n :, m : m + n], L[m + n :, m + n :]
    gain = solve_triangular(L_next, L_gain.T, lower=True, trans=1).T
    after = mean[m : m + n] + L[m : m + n, :m].dot(known)
    constant = before.x + L[m + n :, :m].dot(known) - gain.dot(after)
    return BackwardStep(gain, constant, L_rest.dot(L_rest.T))


class FixedLagSmoother:
    """Runs an estimator over recorded data and looks back."""

    def __init__(self, estimator: Estimator, lag: float) -> None:
        """Look back ``lag`` seconds.

        Raises:
            ValueError: The estimator forgets earlier than that.
        """
        longest = estimator.config.history - estimator.config.max_gap
        if not 0.0 <= lag <= longest + SAME_INSTANT:
            raise ValueError(f"lag: {lag} s is outside [0, {longest:.3g}] s (history - max_gap)")
        self._estimator, self._lag = estimator, lag
        self._told = -math.inf
        self._seen = estimator.past

    def step(self, measurements: Sequence[Measurement], tau: Array, t: float) -> list[Smoothed]:
        """Step the estimator; return the instants that are now older than the lag, oldest first.

        When time jumps, those before the jump are returned first, with what was known then.

        Args:
            measurements: Of any sensor, age and order.
            tau: Torque that acted until ``t``, (n_theta,).
            t: Now [s].
        """
        return self.look_back(self._estimator.step(measurements, tau, t).t)

    def look_back(self, t: float) -> list[Smoothed]:
        """Return the instants that are now older than the lag, oldest first; the estimator has been stepped.

        Args:
            t: Now [s].
        """
        seen, self._seen = self._seen, self._estimator.past
        told = []
        if self._seen[1] is not seen[1]:  # the history began anew
            told = self._tell(*seen, math.inf)
            self._told = -math.inf
        return told + self._tell(*self._seen, t - self._lag)

    def finish(self) -> list[Smoothed]:
        """Return the instants that are left, oldest first."""
        return self._tell(*self._estimator.past, math.inf)

    def _tell(self, parts: Parts, instants: Sequence[Instant], until: float) -> list[Smoothed]:
        """Return what has not been told up to a time [s]; the first instant is the fixed start."""
        until += SAME_INSTANT
        due = [i for i in range(1, len(instants)) if self._told < instants[i].t <= until]
        if not due:
            return []
        beliefs = smooth(parts.fusion, instants[due[0] :])
        told = [Smoothed(instants[i].t, belief, parts) for i, belief in zip(due, beliefs, strict=False)]
        self._told = told[-1].t
        return told
