"""Fusing a pose: a joint step that moves nothing (A = I, Q = 0) and has the pose's Jacobian as rows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filter import Belief
from flexarm_estimator.joint_step import JointStep, PreparedStep
from flexarm_estimator.process import Transition
from flexarm_estimator.stack import Stack
from flexarm_estimator.step_runner import StepRunner

Array = NDArray[np.float64]


class PoseUpdate:
    """Update by one sensor whose Jacobian is new every time."""

    def __init__(self, name: str, rows: int, n_x: int, runner: StepRunner) -> None:
        """Make the step for ``rows`` numbers and ``n_x`` states."""
        still = Transition(0.0, np.eye(n_x), np.zeros((n_x, 1)), np.zeros((n_x, n_x)), np.zeros((n_x, rows)))
        C, D, R = np.zeros((rows, n_x)), np.zeros((rows, 1)), np.eye(rows)
        stack = Stack((name,), (slice(0, rows),), C, D, np.zeros((rows, rows)), R, R)
        self._step = JointStep(still, stack)
        self._prepared = PreparedStep(0.0, self._step, np.zeros(1), None)
        self._runner = runner

    def fuse(self, belief: Belief, nu: Array, H: Array, R: Array) -> tuple[float, Belief | None]:
        """Return ``nu' S^-1 nu`` and the belief after the sample, None when rounding forbids it.

        Args:
            belief: Before it.
            nu: Innovation, (m,).
            H: Jacobian, (m, n_x).
            R: Noise covariance, (m, m).
        """
        self._step.set_rows(H, R)
        prepared = self._prepared
        prepared.y[:] = nu + H.dot(belief.x)
        done = self._runner.run(belief, (prepared,))
        x, P = prepared.belief
        return float(prepared.nis[0]), Belief(x.copy(), P.copy()) if done else None
