"""Looking back: every state of some instants in a row given the samples of all of them.

The noise of the rows at k+1 is correlated with the process noise that leads there (accelerometers feel the
forces that move the arm), so ``y_k+1`` says something of ``x_k`` that ``x_k+1`` does not: the recursion of
the textbooks [Rauch1965] is not exact. But given ``x_k+1`` and ``y_k+1``, nothing later says more of ``x_k``.
With the Cholesky factor of the joint covariance of ``[y_k+1; x_k+1; x_k]`` given all up to k::

    L = [L_y 0 0; L_+y L_+ 0; L_ky L_k+ L_k]         Gamma = L_k+ L_+^-1
    x_k|K = x_k|k + L_ky L_y^-1 nu + Gamma (x_k+1|K - x_k+1|k+1)      P_k|K = L_k L_k' + Gamma P_k+1|K Gamma'

where ``x_k+1|k+1`` is given the rows alone: a pose of the same instant depends on ``x_k+1`` only.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf, dtrtrs

from flexarm_estimator.filter import Belief
from flexarm_estimator.fusion import Fusion
from flexarm_estimator.history import Instant
from flexarm_estimator.state.state_map import StateMap

Array = NDArray[np.float64]
_LEAST = 1e-300  # variance, to divide by
_RANK = 1e-12  # of the largest eigenvalue; less is rounding


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


def smooth(instants: Sequence[Instant]) -> list[Belief]:
    """Return the belief of every instant given the samples of all of them.

    Args:
        instants: In order of time, computed.
    """
    x, P = instants[-1].belief
    beliefs = [Belief(x.copy(), P.copy())]
    for before, instant in zip(instants[-2::-1], instants[:0:-1], strict=True):
        if instant.entry is None:
            step = backward_step(instant.parts.fusion, before.belief, before.t, instant)
        else:
            step = leave(instant.entry, before.belief)
        beliefs.append(step.apply(beliefs[-1]))
    return beliefs[::-1]


def leave(entry: StateMap, before: Belief) -> BackwardStep:
    """Return how the state ``before`` another model was adopted follows from that in its coordinates."""
    x, P = entry.apply(before)
    scale = np.sqrt(np.maximum(P.diagonal(), _LEAST))
    inverse = np.linalg.pinv(P / np.outer(scale, scale), rcond=_RANK, hermitian=True)
    gain = before.P.dot(entry.T.T).dot(inverse / np.outer(scale, scale))
    lost = np.eye(before.x.size) - gain.dot(entry.T)
    rest = lost.dot(before.P).dot(lost.T) + gain.dot(entry.added).dot(gain.T)
    return BackwardStep(gain, before.x - gain.dot(x), rest)


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
    joint = np.zeros((m + 2 * n, m + 2 * n))
    joint[: m + n, : m + n] = J[:-1, :-1]
    if instant.reopening is not None:
        felt = np.eye(n) if step.stack is None else np.vstack([step.stack.C, np.eye(n)])
        joint[: m + n, : m + n] += felt.dot(fusion.widen(instant.reopening)).dot(felt.T)
    joint[m + n :, : m + n] = reach.dot(before.P).T
    joint[m + n :, m + n :] = before.P
    scale = np.sqrt(np.maximum(joint.diagonal(), _LEAST))
    L, info = dpotrf(joint / np.outer(scale, scale), lower=1, clean=1)
    if info != 0:  # rounding: what came later is left out
        return BackwardStep(np.zeros((n, n)), before.x, before.P)
    L *= scale[:, None]
    known = dtrtrs(L[:m, :m], nu, lower=1)[0] if m else nu
    L_next, L_gain, L_rest = L[m : m + n, m : m + n], L[m + n :, m : m + n], L[m + n :, m + n :]
    gain = dtrtrs(L_next, L_gain.T, lower=1, trans=1)[0].T
    after = mean[m : m + n] + L[m : m + n, :m].dot(known)
    constant = before.x + L[m + n :, :m].dot(known) - gain.dot(after)
    return BackwardStep(gain, constant, L_rest.dot(L_rest.T))
