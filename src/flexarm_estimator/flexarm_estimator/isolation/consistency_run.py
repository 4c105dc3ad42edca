r"""How well the recent past fits the model: the filter from a broad start on, many data side by side.

All data share the covariances, so one Cholesky factorisation a step serves them all (``joint_step``)::

    T P T' + noise = L L'     L = [L_y 0; L_xy L_x]
    z = L_y^-1 (Y - T_y X - V_y u)     X+ = T_x X + V_x u + L_xy z     P+ = L_x L_x'

with a column of Y and X for every hypothesis. ``-2 log p(y) = sum z'z + 2 log det L_y`` up to a constant. A
channel that is to be left out at a step has its noise raised by ``_IGNORED``; what the others predict for it
falls out on the way. A datum counts at most ``_LARGEST``: an impact is nobody's fault.

The filter is linear: what a drifting offset of a channel does to z is a column of its own, so the offset that
explains the data best is a small problem of least squares at the end (``excused``). What the served model
leaves out of the motion (``StepSource.inputs``) and tangents by what is learned are taken at the mean of the
hypothesis that explains best so far: the estimator's own has believed the channel that is looked for.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf, dtrtrs

from flexarm_estimator.adoption import map_parts
from flexarm_estimator.filter import Belief
from flexarm_estimator.isolation.consistency_steps import RunArrays, bind_steps
from flexarm_estimator.isolation.window import StepMaker, Window, WindowStep

Array = NDArray[np.float64]
_IGNORED = 1e8  # times the variance of the innovation
_LARGEST = 100.0  # squared sigmas
_MAPPING_ERROR = 0.3  # of the modal coordinates, when one model follows another


class ConsistencyRun:
    """A run of the filter over a window, a few steps at a time; results are there when it is done.

    Attributes:
        predicted: Of the first column, by all rows before, (k, m).
        variance: Of the prediction's error, (k, m).
        least: Least misfit in both halves of the first column with the offsets looked for so far, (2,).
        is_sound: False when rounding forbade to go on.
    """

    def __init__(
        self,
        window: Window,
        Y: Array,
        maker: StepMaker,
        ignored: NDArray[np.bool_],
        offsets: Array | None = None,
    ) -> None:
        """Start.

        Args:
            window: The recent past.
            Y: Data of every hypothesis, (k, m, n_h).
            maker: Of the joint steps.
            ignored: Rows to be left out, (k, m).
            offsets: One sigma of a constant and of a ramp that every channel may be off by, to be looked for;
                SI of the channel, (m, 2).
        """
        self._window, self._maker, self._ignored = window, maker, np.ascontiguousarray(ignored)
        parts, k, m, self._n_h = window.parts[0], *Y.shape
        Y = Y if offsets is None else np.concatenate([Y, _offset_columns(k, offsets)], axis=2)
        self._Y = np.ascontiguousarray(Y)
        self._Z, self._diagonals = np.zeros(self._Y.shape), np.ones((k, m))
        self._X, self._P = np.zeros((parts.layout.n_x, self._Y.shape[2])), parts.process.P0.copy()
        self._X[parts.layout.theta, : self._n_h] = window.theta[:, None]
        self._X[parts.layout.p, : self._n_h] = np.array(window.learned)[:, None]
        self.predicted, self.variance = np.zeros((k, m)), np.ones((k, m))
        self.least = np.full(2, np.inf)
        self._running = np.zeros(self._n_h)  # misfit so far
        self._next = 1
        self.is_sound = True
        self._bind(1)

    @property
    def is_done(self) -> bool:
        """All steps are computed, or rounding forbids more."""
        return self._next >= len(self._window.t) or not self.is_sound

    def advance(self, steps: int) -> None:
        """Compute some more steps."""
        for _ in range(steps):
            if self.is_done:
                return
            self._advance_one(self._next)
            self._next += 1

    @cached_property
    def misfit(self) -> Array:
        """Sum of z'z of each half of the window, (2, n_h)."""
        return self._window.halves(_capped(self._Z[:, :, : self._n_h]).sum(axis=1))

    @cached_property
    def log_det(self) -> Array:
        """Sum of 2 log det L_y of each half, without what was left out, (2,)."""
        logs = 2.0 * np.log(self._diagonals)
        logs[self._ignored] -= np.log(_IGNORED * self.variance[self._ignored])
        logs[0] = 0.0
        return self._window.halves(logs.sum(axis=1))

    @cached_property
    def marginal(self) -> Array:
        """Squared innovations of the first column over their variance, mean of every row, (m,)."""
        squares = (self._Y[:, :, 0] - self.predicted) ** 2 / self.variance
        used = ~self._ignored
        used[0] = False
        return np.asarray((squares * used).sum(axis=0) / used.sum(axis=0).clip(1))

    def total(self, column: int) -> Array:
        """Return ``-2 log p`` of both halves, (2,)."""
        return self.misfit[:, column] + self.log_det

    def spread(self, column: int) -> float:
        """Return the misfit of a datum, at least 1."""
        used = int(np.count_nonzero(~self._ignored[1:]))
        return max(1.0, float(self.misfit[:, column].sum()) / max(used, 1))

    def excused(self, channel: int) -> Array:
        """Return the misfit of the first column but for a drifting offset of a channel, by halves, (2,)."""
        z, at = self._Z[:, :, 0], self._n_h + 2 * channel
        response = self._Z[:, :, at : at + 2].reshape(-1, 2)
        amounts = np.linalg.solve(np.eye(2) + response.T.dot(response), response.T.dot(z.ravel()))
        left = _capped(z - response.dot(amounts).reshape(z.shape)).sum(axis=1)
        excused = np.asarray(self._window.halves(left) + float(amounts.dot(amounts)) / 2.0)
        self.least = min(self.least, excused, key=lambda misfit: float(misfit.sum()))
        return excused

    def _advance_one(self, k: int) -> None:
        window = self._window
        if window.parts[k] is not window.parts[k - 1]:
            self._change_model(k)
        x, dt = self._X[:, int(np.argmin(self._running))].copy(), float(window.t[k] - window.t[k - 1])
        self._u[k] = window.parts[k].steps.inputs(Belief(x, self._P), dt, window.u[k])
        step = self._maker.step(window.parts[k], dt).about(x, self._u[k])
        if self._steps is None:
            self._compute(k, step)
        else:
            self.is_sound = self._steps.compute(k, step)

    def _bind(self, k: int) -> None:
        """Let machine code work on the arrays of the run from step ``k`` on, where there is a compiler."""
        window = self._window
        dt = float(window.t[k] - window.t[k - 1])
        self._u = np.zeros((len(window.t), self._maker.step(window.parts[k], dt).V.shape[1]))
        results = self._Z, self._diagonals, self.predicted, self.variance, self._running
        data = self._Y, self._u, self._ignored
        arrays = RunArrays(*data, self._X, self._P, *results)
        self._steps = bind_steps(arrays, self._n_h, _IGNORED, _LARGEST)

    def _compute(self, k: int, step: WindowStep) -> None:
        m, rows = step.m, np.flatnonzero(self._ignored[k])
        J = step.T.dot(self._P).dot(step.T_transposed)
        J += step.noise
        diagonal = J.ravel()[: m * (J.shape[1] + 1) : J.shape[1] + 1]
        self.variance[k] = diagonal
        mean = step.T.dot(self._X)
        mean[:, : self._n_h] += step.V.dot(self._u[k])[:, None]
        self.predicted[k] = mean[:m, 0]
        nu = self._Y[k] - mean[:m]
        if rows.size:
            diagonal[rows] *= _IGNORED
            nu[rows] = 0.0
        L, info = dpotrf(J.T, lower=1, clean=1, overwrite_a=1)
        if info:
            self.is_sound = False
            return
        z = self._Z[k] = dtrtrs(L[:m, :m], nu, lower=1)[0]
        self._diagonals[k] = L.diagonal()[:m]
        self._running += _capped(z[:, : self._n_h]).sum(axis=0)
        L_x = L[m:, m:]
        self._X, self._P = mean[m:] + L[m:, :m].dot(z), L_x.dot(L_x.T)

    def _change_model(self, k: int) -> None:
        """Go over to the model of step ``k``; what its modes cannot show of the old ones is not known."""
        before, parts = self._window.parts[k - 1], self._window.parts[k]
        mapping = map_parts(before, parts)
        self._X, self._P = mapping.T @ self._X, mapping.T @ self._P @ mapping.T.T + mapping.added
        for part in (parts.layout.eta, parts.layout.eta_dot):
            largest = np.abs(self._X[part][:, [0, int(np.argmin(self._running))]]).max(axis=1)
            self._P[part, part] += np.diag((_MAPPING_ERROR * largest) ** 2)
        self._bind(k)


def _capped(z: Array) -> Array:
    return np.minimum(z * z, _LARGEST)


def _offset_columns(k: int, sigma: Array) -> Array:
    """Return a constant and a ramp in every channel, of one sigma (m, 2) each, (k, m, 2 m)."""
    m = len(sigma)
    Y = np.zeros((k, m, 2 * m))
    for i in range(m):
        Y[:, i, 2 * i], Y[:, i, 2 * i + 1] = sigma[i, 0], sigma[i, 1] * np.linspace(-1.0, 1.0, k)
    return Y
