"""Fusing a pose: a joint step that moves nothing (A = I, Q = 0) and has the pose's Jacobian as rows.

A pose is no linear function of the state: where an axis is off by ``e``, the tip lies ``r e^2 / 2`` off the
tangent. A sample that the tangent at the mean refuses is looked at about the likeliest state instead, by
Gauss and Newton [Bell1993]; at the end ``nu' S^-1 nu`` is the least misfit of sample and belief together.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filter import Belief
from flexarm_estimator.filters.step_source import Look
from flexarm_estimator.state.process import Transition
from flexarm_estimator.steps.joint_step import JointStep, PreparedStep
from flexarm_estimator.steps.stack import Stack
from flexarm_estimator.steps.step_runner import StepRunner

Array = NDArray[np.float64]
_MOST = 30  # looks; from the other side of a circle some fifteen are needed
_ARRIVED = 0.1  # sigma of the sensor by which a further look moves the prediction


class PoseFit(NamedTuple):
    """What a pose says of a belief.

    Attributes:
        nis: Misfit ``nu' S^-1 nu`` [1].
        updated: Belief after the sample; None when rounding forbids it.
        look: Innovation and tangent that it was updated with.
    """

    nis: float
    updated: Belief | None
    look: Look


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

    def fit(self, belief: Belief, look: Callable[[Belief], Look], R: Array, bound: float) -> PoseFit:
        """Return what a sample says; a misfit beyond ``bound`` is looked at more closely.

        Args:
            belief: Before it.
            look: Gives innovation and tangent about a state.
            R: Noise covariance, (m, m).
            bound: Of ``nu' S^-1 nu``.

        Raises:
            ValueError: The pose cannot be predicted at the mean.
        """
        seen = look(belief)
        nis, updated = self.fuse(belief, seen.nu, seen.H, R + seen.spread)
        first = PoseFit(nis, updated, seen)
        if nis <= bound or updated is None:
            return first
        sigma = np.sqrt(R.diagonal())
        for _ in range(_MOST):
            about = Belief(updated.x, belief.P)
            try:
                seen = look(about)
            except ValueError:  # loops do not close there
                return first
            nu = seen.nu + seen.H.dot(about.x - belief.x)
            nis, updated = self.fuse(belief, nu, seen.H, R + seen.spread)
            if updated is None or not math.isfinite(nis):
                return first
            if (abs(seen.H.dot(updated.x - about.x)) <= _ARRIVED * sigma).all():
                return PoseFit(nis, updated, Look(nu, seen.H, seen.spread))
        return first

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
