"""The motion that the nonlinear controller expects: where its horizon is linearised."""

from __future__ import annotations

import numpy as np

from flexarm_controller.nonlinear.gauss_steps import GaussSteps, Points
from flexarm_controller.nonlinear.goal_window import GoalWindow

NEVER = -np.inf  # s
SAME_INSTANT = 1e-9  # s; stamps are whole nanoseconds


class MotionGuess:
    """States, torques and accelerations over the horizon.

    Attributes:
        points: Of the periods.
        end: State behind the horizon, (n_x,).
        t: When its first period begins [s]; ``NEVER`` while there is no motion.
    """

    def __init__(self, steps: GaussSteps, N: int) -> None:
        """Make room for ``N`` periods."""
        self.points, self.end, self.t = Points(steps, N), np.zeros(2 * steps.n), NEVER
        self._h, self._n, self._n_u = steps.h, steps.n, steps.n_u

    def is_at(self, t: float) -> bool:
        """Tell whether the horizon begins at ``t`` [s]."""
        return abs(t - self.t) <= SAME_INSTANT

    def forget(self) -> None:
        """Have no motion any more."""
        self.t = NEVER

    def reach(self, t: float) -> bool:
        """Move on by whole periods until the horizon begins at ``t`` [s]; returns whether that works."""
        late = (t - self.t) / self._h
        if not (-0.5 < late < len(self.points.s) / 2 and abs(late - round(late)) * self._h <= SAME_INSTANT):
            return False
        for _ in range(round(late)):
            self.shift()
        self.t = t
        return True

    def shift(self) -> None:
        """Move on by one period; the last one is held."""
        points = self.points
        for rows in (points.s, points.u, points.a):
            rows[:-1] = rows[1:]
        points.s[-1] = self.end
        self.t += self._h

    def restart(self, goal: GoalWindow, t: float) -> None:
        """Expect the motion of the reference from ``t`` [s] on."""
        points, N = self.points, len(self.points.s)
        points.s[:], points.u[:], self.end[:] = goal.s[:N], goal.u[:N], goal.s[N]
        points.a[:] = 0.0
        for stage in (points.a[:, : self._n], points.a[:, self._n :]):
            stage[:, : self._n_u] = goal.r[:N, 2 * self._n_u :]
        self.t = t
