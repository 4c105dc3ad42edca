"""States and torques that go with the reference over the horizon, each worked out once.

They come from the nonlinear equation of motion: the axes move as the reference does and the other
coordinates stand in equilibrium with the inertia, gravity and gyroscopic forces of that. The window moves
on by one period from step to step, so one new instant is worked out per step.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.nonlinear.gauss_steps import GaussSteps
from flexarm_controller.reference import Reference

Array = NDArray[np.float64]
SAME_INSTANT = 1e-9  # s; stamps are whole nanoseconds


class GoalWindow:
    """The reference at ``N + 1`` instants.

    Attributes:
        r: ``[theta; theta'; theta'']``, (N + 1, 3 n_u).
        s: States, (N + 1, n_x).
        u: Torques, (N + 1, n_u).
        at_rest: States at rest in the reference's positions, (N + 1, n_x).
    """

    def __init__(self, steps: GaussSteps, N: int, start: Array, is_rest_needed: bool) -> None:
        """Make room; ``start`` (n_x,) is a first guess of a state."""
        self._steps, self._is_rest_needed = steps, is_rest_needed
        self.r, self.s = np.zeros((N + 1, 3 * steps.n_u)), np.tile(start, (N + 1, 1))
        self.at_rest, self.u = self.s.copy(), np.zeros((N + 1, steps.n_u))
        self._torque, self._offsets = np.zeros((N + 1, steps.n_u)), np.arange(N + 1.0) * steps.h
        self._reference: Reference | None = None
        self._t, self._is_sound = 0.0, False

    def move(self, reference: Reference, t: float) -> bool:
        """Go to the window of ``reference`` that begins at ``t`` [s]; returns whether all of it is sound."""
        N, h = len(self.s) - 1, self._steps.h
        is_known = self._is_sound and reference is self._reference
        if is_known and abs(t - self._t) <= SAME_INSTANT:
            return True
        first = N if is_known and abs(t - self._t - h) <= SAME_INSTANT else 0
        if first:
            for rows in (self.r, self.s, self.u, self.at_rest):
                rows[:-1] = rows[1:]
        self._reference, self._t = reference, t
        self._is_sound = self._work_out(first)
        return self._is_sound

    def _work_out(self, first: int) -> bool:
        """Fill the window from the instant ``first`` on; the states that are there are the guess."""
        assert self._reference is not None
        n_u, new = self._steps.n_u, slice(first, None)
        self.r[new] = self._reference.stacked(self._t + self._offsets[new])
        if not self._steps.rest(self.r[new], self.s[new], self.u[new]):
            self.s[new] = self.at_rest[new] = 0.0  # another start for the next time
            return False
        if not self._is_rest_needed:
            return True
        still = np.hstack([self.r[new, :n_u], np.zeros((len(self.r[new]), 2 * n_u))])
        return self._steps.rest(still, self.at_rest[new], self._torque[new])
