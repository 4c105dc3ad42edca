r"""How well the recent past fits the model: the filter from a broad start on, many data side by side.

All data share the covariances, so one Cholesky factorisation a step serves them all (``joint_step``)::

    T P T' + noise = L L'     L = [L_y 0; L_xy L_x]
    z = L_y^-1 (Y - T_y X - V_y u)     X+ = T_x X + V_x u + L_xy z     P+ = L_x L_x'

with a column of Y and X for every hypothesis. ``-2 log p(y) = sum z'z + 2 log det L_y`` up to a constant. A
channel that is to be left out at a step has its noise raised by ``_IGNORED``; what the others predict for it
falls out on the way. Sums are kept by halves of the window. A datum counts at most ``_LARGEST``: an impact is
nobody's fault.

The filter is linear: what a drifting offset of a channel does to z is a column of its own, so the offset that
explains the data best is a small problem of least squares at the end (``excused``). What the served model
leaves out of the motion (``StepSource.inputs``) and tangents by what is learned are taken at the mean of the
hypothesis that explains best so far: the estimator's own has believed the channel that is looked for. Modes
bend the arm there as far as they are known to (``known_modes``).
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf, dtrtrs

from flexarm_estimator.adoption import map_parts
from flexarm_estimator.filter import Belief
from flexarm_estimator.isolation.consistency_steps import Data, MachineSteps, Room, bind_steps, make_room
from flexarm_estimator.isolation.hypotheses import Hypotheses
from flexarm_estimator.isolation.known_modes import known_modes
from flexarm_estimator.isolation.window import StepMaker, Window, WindowStep

Array = NDArray[np.float64]
_IGNORED = 1e8  # times the variance of the innovation
_LARGEST = 100.0  # squared sigmas
_MAPPING_ERROR = 0.3  # of the modal coordinates, when one model follows another
NO_OFFSETS: Array = np.zeros((0, 2))


class ConsistencyRun:
    """A run of the filter over a window, a few steps at a time; results are there when it is done.

    Attributes:
        least: Least misfit in both halves of "all well" with the offsets looked for so far, (2,).
        is_sound: False when rounding forbade to go on.
    """

    def __init__(
        self,
        window: Window,
        hypotheses: Hypotheses,
        maker: StepMaker,
        ignored: NDArray[np.bool_],
        offsets: Array = NO_OFFSETS,
    ) -> None:
        """Start.

        Args:
            window: The recent past.
            hypotheses: The first is "all well".
            maker: Of the joint steps.
            ignored: Rows to be left out, (k, m); all that say nothing are.
            offsets: One sigma of a constant and of a ramp that every channel may be off by, to be looked for;
                SI of the channel, (m, 2).
        """
        self._window, self._maker, self._next, self.is_sound = window, maker, 1, True
        self._data = Data(np.ascontiguousarray(window.y), np.ascontiguousarray(ignored), hypotheses, offsets)
        self.least = np.full(2, np.inf)

    @property
    def predicted(self) -> Array:
        """Of "all well", by all rows before, (k, m)."""
        return self._room.predicted

    @property
    def variance(self) -> Array:
        """Of the prediction's error, (k, m)."""
        return self._room.variance

    @property
    def misfit(self) -> Array:
        """Sum of z'z of each half of the window, (2, n_h)."""
        return self._room.misfit

    @property
    def log_det(self) -> Array:
        """Sum of 2 log det L_y of each half, without what was left out, (2,)."""
        return self._room.log_det

    @property
    def is_done(self) -> bool:
        """All steps are computed, or rounding forbids more."""
        return self._next >= len(self._window.t) or not self.is_sound

    def reserve(self) -> None:
        """Make room now, not in the first step."""
        self._room  # noqa: B018, it is made when it is looked at

    def advance(self, steps: int) -> None:
        """Compute some more steps."""
        end = min(self._next + steps, len(self._window.t))
        while self._next < end and self.is_sound:
            self._next += self._advance(self._next, end)

    @property
    def extremes(self) -> tuple[float, float]:
        """The largest of ``marginal``, and what the best hypothesis gains in both halves together."""
        if self._steps is not None:
            return self._steps.extremes()
        return float(self.marginal.max()), float(self.gains.sum(axis=0)[1:].max(initial=-np.inf))

    @cached_property
    def marginal(self) -> Array:
        """Squared innovations of "all well" over their variance, mean of every row, (m,)."""
        return np.asarray(self._room.squares / self._room.used.clip(1.0))

    @cached_property
    def spreads(self) -> Array:
        """Misfit of a datum under every hypothesis, at least 1, (n_h,)."""
        return np.asarray((self.misfit.sum(axis=0) / max(self._room.used.sum(), 1.0)).clip(1.0))

    @cached_property
    def gains(self) -> Array:
        """What every hypothesis explains better than "all well", over the misfit it leaves, (2, n_h)."""
        return (self.misfit[:, :1] - self.misfit) / self.spreads

    def total(self, column: int) -> Array:
        """Return ``-2 log p`` of both halves, (2,)."""
        return self.misfit[:, column] + self.log_det

    def spread(self, column: int) -> float:
        """Return the misfit of a datum, at least 1."""
        return float(self.spreads[column])

    def excused(self, channel: int) -> Array:
        """Return the misfit of "all well" but for a drifting offset of a channel, by halves, (2,).

        Only of a run with offsets.
        """
        Z, at = self._room.Z, self.misfit.shape[1] + 2 * channel
        z, response = Z[:, :, 0], Z[:, :, at : at + 2].reshape(-1, 2)
        amounts = np.linalg.solve(np.eye(2) + response.T.dot(response), response.T.dot(z.ravel()))
        left = _capped(z - response.dot(amounts).reshape(z.shape)).sum(axis=1)
        excused = np.asarray(self._window.halves(left) + float(amounts.dot(amounts)) / 2.0)
        self.least = min(self.least, excused, key=lambda misfit: float(misfit.sum()))
        return excused

    @cached_property
    def _room(self) -> Room:
        """Room of the run, with what is known at the start."""
        window, parts, data = self._window, self._window.parts[0], self._data
        room = make_room(data, parts.layout.n_x, self._step(1).V.shape[1])
        room.x[parts.layout.theta], room.x[parts.layout.p] = window.theta, window.learned
        room.P[:], b = parts.process.P0, parts.layout.b
        room.X[:, : len(data.hypotheses.all)] = room.x[:, None]
        if window.biases is not None and window.biases.mean.size == b.stop - b.start:
            room.x[b], room.P[b, b] = window.biases.mean, np.diag(window.biases.variance)
            room.X[b, : len(data.hypotheses.all)] = window.biases.under(data.hypotheses)
        room.variance.fill(1.0)
        return room

    @cached_property
    def _steps(self) -> MachineSteps | None:
        """The steps in machine code, where there is a compiler; bound in the first of them."""
        return bind_steps(self._data, self._room, _IGNORED, _LARGEST)

    def _advance(self, k: int, end: int) -> int:
        """Compute step ``k``, and those after it that are alike; return how many."""
        window = self._window
        parts, dt = window.parts[k], window.periods[k - 1]
        if parts is not window.parts[k - 1]:
            self._change_model(k)
        step, count = self._step(k), 1
        if parts.steps.is_constant and not step.slopes:
            while k + count < end and window.is_alike(k, k + count, self._maker.resolution):
                count += 1
            self._room.u[k : k + count] = window.u[k : k + count]
        else:
            before = Belief(self._room.x, self._room.P)
            u = self._room.u[k] = parts.steps.inputs(known_modes(before, parts.layout), dt, window.u[k])
            step = step.about(before.x, u)
        if self._steps is not None:
            self.is_sound = self._steps.compute(k, count, step)
        else:
            self.is_sound = all(self._compute(i, step) for i in range(k, k + count))
        return count

    def _step(self, k: int) -> WindowStep:
        return self._maker.step(self._window.parts[k], self._window.periods[k - 1])

    def _compute(self, k: int, step: WindowStep) -> bool:
        """Compute a step with NumPy; False when rounding forbids it."""
        room, m, out, n_h = self._room, step.m, self._data.ignored[k], self.misfit.shape[1]
        half = int(k >= (len(self._window.t) + 1) // 2)
        J = step.T.dot(room.P).dot(step.T_transposed) + step.noise
        diagonal = J.ravel()[: m * (J.shape[1] + 1) : J.shape[1] + 1]
        room.variance[k] = diagonal
        mean = step.T.dot(room.X)
        mean[:, :n_h] += step.V.dot(room.u[k])[:, None]
        room.predicted[k] = mean[:m, 0]
        nu = self._said(k) - mean[:m]
        diagonal[out] *= _IGNORED
        nu[out] = 0.0
        room.squares[:] += nu[:, 0] ** 2 / room.variance[k]
        room.used[:] += ~out
        L, info = dpotrf(J.T, lower=1, clean=1, overwrite_a=1)
        if info:
            return False
        z = room.Z[k if len(room.Z) > 1 else 0] = dtrtrs(L[:m, :m], nu, lower=1)[0]
        room.misfit[half] += _capped(z[:, :n_h]).sum(axis=0)
        logs = 2.0 * np.log(L.diagonal()[:m])
        room.log_det[half] += logs.sum() - np.log(_IGNORED * room.variance[k, out]).sum()
        L_x = L[m:, m:]
        room.X[:], room.P[:] = mean[m:] + L[m:, :m].dot(z), L_x.dot(L_x.T)
        room.x[:] = room.X[:, self._best]
        return True

    @property
    def _best(self) -> int:
        """The hypothesis that explains best so far."""
        return int(np.argmin(self.misfit.sum(axis=0)))

    def _said(self, k: int) -> Array:
        """Return what step ``k`` would have said were a hypothesis true, then the offsets, (m, columns)."""
        y, offsets, hypotheses = np.nan_to_num(self._data.y[k]), self._data.offsets, self._data.hypotheses
        said = y[hypotheses.source] * hypotheses.sign
        m, ramp = len(offsets), 2.0 * k / (len(self._window.t) - 1) - 1.0
        columns = np.zeros((m, m, 2))
        columns[np.arange(m), np.arange(m)] = offsets * [1.0, ramp]
        return np.hstack([said, columns.reshape(m, 2 * m)]) if m else said

    def _change_model(self, k: int) -> None:
        """Go over to the model of step ``k``; what its modes cannot show of the old ones is not known."""
        before, parts, old = self._window.parts[k - 1], self._window.parts[k], self._room
        mapping = map_parts(before, parts)
        X, P = mapping.T @ old.X, mapping.T @ old.P @ mapping.T.T + mapping.added
        for part in (parts.layout.eta, parts.layout.eta_dot):
            largest = np.abs(X[part][:, [0, self._best]]).max(axis=1)
            P[part, part] += np.diag((_MAPPING_ERROR * largest) ** 2)
        room = make_room(self._data, parts.layout.n_x, self._step(k).V.shape[1])
        for name in ("Z", "predicted", "variance", "misfit", "log_det", "squares", "used"):
            getattr(room, name)[:] = getattr(old, name)
        room.X[:], room.P[:], room.x[:] = X, P, X[:, self._best]
        self._room, self._steps = room, bind_steps(self._data, room, _IGNORED, _LARGEST)


def _capped(z: Array) -> Array:
    return np.minimum(z * z, _LARGEST)
