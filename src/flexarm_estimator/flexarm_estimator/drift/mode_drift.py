"""Running changes of stiffness and damping of every mode: innovations regressed on their slopes.

While the true parameters are off by ``delta`` the innovations are ``nu = white - psi delta``, so that with
the covariance ``S`` of the innovations and forgetting of what is older than the memory::

    delta = -(sum psi' S^-1 psi + 1 / prior^2)^-1 sum psi' S^-1 nu

What the model leaves out makes innovations larger than the filter believes, and not white: their mean square
is measured, and so is the scatter over blocks (``score_blocks``), averaged for long, or a change of a mode
would count as scatter; the larger sigma counts. A time in which a mode does not ring, or without
samples, says nothing of it: its sigma goes back to that of the prior.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.drift.score_blocks import ScoreBlocks
from flexarm_estimator.drift.sensitivity import WatchedFilter

Array = NDArray[np.float64]
STIFFNESS_PRIOR, DAMPING_PRIOR = 0.3, 1.0  # one sigma of the relative changes before the measurement
BLOCK = 0.5  # s; innovations remember less
LONG = 6.0  # memories over which the scatter is averaged
FAR_AWAY = 0.15  # change of omega^2 of a mode after which what was learned of the others does not hold either
FAR = 25.0  # an innovation of so many mean squares is a knock or a spike: it counts less


@dataclass(frozen=True)
class Deltas:
    """Relative changes against the model, (modes,) each.

    Attributes:
        stiffness: Of ``omega^2``.
        stiffness_sigma: One sigma of it.
        damping: Of ``2 zeta omega``.
        damping_sigma: One sigma of it.
    """

    stiffness: Array
    stiffness_sigma: Array
    damping: Array
    damping_sigma: Array


class ModeDrift:
    """Filter, slopes and sums; a step is one control period."""

    def __init__(self, watched: WatchedFilter, x: Array, dt: float, memory: float) -> None:
        """Start at a state.

        Args:
            watched: Filter of the served model.
            x: State, (n_x,).
            dt: Control period [s].
            memory: Time after which a sample counts 1/e [s].
        """
        count = len(watched.modes)
        prior = np.concatenate([np.full(count, STIFFNESS_PRIOR), np.full(count, DAMPING_PRIOR)])
        self._prior = np.diag(prior**-2)
        self._keep = math.exp(-dt / memory)
        self._size, self._weight = 0.0, 0.0
        self._information = np.zeros_like(self._prior)
        self._told = np.zeros(prior.size)
        self._blocks = ScoreBlocks(prior.size, max(1, round(BLOCK / dt)), self._keep)
        self._scatter, self._looks = np.zeros(prior.size), 0.0
        self._use(watched)
        self.restart(x)

    def restart(self, x: Array) -> None:
        """Go on from a state; what was learned of the modes stays."""
        self.x, self._s = x.copy(), np.zeros((x.size, self._watched.n_p))

    def adopt(self, watched: WatchedFilter, T: Array, x: Array) -> None:
        """Go on with the filter of another model of the same arm.

        Args:
            watched: Of as many modes.
            T: Map of the state, (n_x_new, n_x_old).
            x: State in the new model, (n_x_new,).
        """
        self._use(watched)
        self.x, self._s = x.copy(), T @ self._s

    def move(self, watched: WatchedFilter, T: Array, shift: Array) -> None:
        """Go on about another point; what was learned of a mode that has moved does not hold there.

        Args:
            watched: Filter of the model there.
            T: Map of the state, (n_x, n_x).
            shift: Relative change of ``omega^2`` from the old point, (modes,).
        """
        self.adopt(watched, T, T @ self.x)
        unit = np.concatenate([1.0 + shift, np.sqrt(1.0 + shift)])  # a parameter is relative to its point
        self._s = self._s * unit
        stays = np.tile((shift == 0.0) & (np.abs(shift).max() <= FAR_AWAY), 2)
        before, scale = self._solve()[0], unit * stays
        after = before * stays  # of what has not moved the unit is the same
        self._information = scale[:, None] * self._information * scale
        self._told = -(self._information + self._prior) @ after
        self._blocks.move(before, after, scale)
        self._size = self._weight = 0.0

    def step(self, y: Array | None, u: Array, counts: bool = True) -> None:
        """Go on by one period.

        Args:
            y: Samples at its end in the order of the filter's sensors, (m,); None when one is missing.
            u: [tau; 1] held over it, (n_u + 1,).
            counts: False while the filter settles: nothing is learned.
        """
        watched, m = self._watched, len(self._watched.S)
        pushed = self._slopes.dot(np.concatenate([self.x, u])).reshape(watched.n_p, -1).T  # (m + n_x, n_p)
        x, s = watched.A.dot(self.x) + watched.B.dot(u), watched.A.dot(self._s) + pushed[m:]
        if y is not None:
            nu = y - watched.H.dot(self.x) - watched.V.dot(u)
            psi = -(watched.H.dot(self._s) + pushed[:m])
            x += watched.K.dot(nu)
            s += watched.K.dot(psi)
            if counts:
                self._learn(nu, psi)
        if y is None or not counts:
            self.forget(1)
        self.x, self._s = x, s

    def forget(self, periods: int) -> None:
        """Let what was learned grow older by so many periods, of which nothing is known."""
        keep = self._keep**periods
        self._information, self._told = keep * self._information, keep * self._told
        self._blocks.forget(keep)

    def deltas(self) -> Deltas:
        """Return the changes as known now."""
        delta, P, larger = self._solve()
        prior, n = 1.0 / np.diag(self._prior), len(self._watched.modes)
        coloured = np.maximum(1.0, self._scatter / self._looks) if self._looks else np.ones(prior.size)
        sigma = np.sqrt(np.minimum(np.diag(P) * larger * coloured, prior))
        return Deltas(delta[:n], sigma[:n], delta[n:], sigma[n:])

    def _solve(self) -> tuple[Array, Array, float]:
        """Return the changes, their covariance for innovations as believed, and how much larger these are."""
        P = np.linalg.inv(self._information + self._prior)
        return -P @ self._told, P, max(1.0, self._size / self._weight) if self._weight else 1.0

    def _look_at_scatter(self) -> None:
        """Average how much the blocks scatter beyond what white innovations would."""
        delta, P, larger = self._solve()
        coloured = np.diag(P @ (self._blocks.scatter(delta) + self._prior) @ P)
        keep = self._keep ** (self._blocks.periods / LONG)
        self._scatter = keep * self._scatter + coloured / (np.diag(P) * larger)
        self._looks = keep * self._looks + 1.0

    def _use(self, watched: WatchedFilter) -> None:
        self._watched, self._W = watched, np.linalg.inv(watched.S)
        self._slopes = watched.slopes.reshape(-1, watched.slopes.shape[2])

    def _learn(self, nu: Array, psi: Array) -> None:
        weighted = self._W.dot(nu)
        size = float(nu.dot(weighted)) / nu.size
        usual = max(1.0, self._size / self._weight) if self._weight else 1.0
        share = min(1.0, FAR * usual / size) if size > 0.0 else 1.0
        information, told = share * psi.T.dot(self._W).dot(psi), share * psi.T.dot(weighted)
        keep = self._keep
        self._size = keep * self._size + share * size
        self._weight = keep * self._weight + 1.0
        self._information = keep * self._information + information
        self._told = keep * self._told + told
        if self._blocks.add(information, told):
            self._look_at_scatter()
