"""What a law has learned of an arm so far: softer modes, heavier axes, in steps.

It is of the arm and not of one model: stiffness and inertia are shares of what a model describes, so when
the pose moves and another model is served, its law begins where the last one has come.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.learned.axis_inertia import AxisInertia
from flexarm_controller.reference import Reference
from flexarm_controller.settings import MpcConfig
from flexarm_controller.state import ArmState

Array = NDArray[np.float64]
Steps = tuple[tuple[int, ...], tuple[int, ...]]  # of stiffness and of inertia; none where all are zero
LEAVE = 0.75  # steps away from the present one at which the nearest takes over: half would be no hysteresis
LOWEST, HIGHEST = -0.6, 1.0  # believed of a relative error; beyond it something else is wrong
MISSED = 1.5  # periods from one to the next, from which one is missing
OFTEN = 20  # times within the lag of the estimated torque, which tells nothing new sooner


class Learning:
    """Learns from period to period, whichever model is served.

    Attributes:
        steps: Steps of the slowest modes' stiffness and of the axes' inertia.
    """

    def __init__(self, n_theta: int, config: MpcConfig, dt: float) -> None:
        """Know nothing yet.

        Args:
            n_theta: Axes.
            config: Sizes of the steps, lag of the estimated torque.
            dt: Control period [s].
        """
        self.steps: Steps = (), ()
        self._sizes = config.stiffness_step, config.inertia_step
        self._every = max(1, round(config.disturbance_lag / OFTEN / dt))
        self._passed = 0  # periods since it learned last
        self._dt, self._t = dt, -math.inf  # when it was told of a period last [s]
        self._axes = AxisInertia(n_theta, config.disturbance_lag, self._every * dt)

    def begin(self, t: float) -> None:
        """Begin a period at ``t`` [s]: where some were left out, the arm was not led in between."""
        gap = t - self._t
        if not 0.0 <= gap < MISSED * self._dt:
            self._axes.pause(gap - self._dt if gap > 0.0 else math.inf)
        self._t = t

    def learn(self, state: ArmState, reference: Reference, inertia: Array) -> None:
        """Take one period's state, what was wanted of it, and the axes' described inertia, (n_theta,)."""
        self._passed += 1
        if self._passed < self._every:
            return
        self._passed = 0
        (stiffness, share), (softer, heavier) = self.steps, self._sizes
        if softer:
            stiffness = follow_steps(stiffness, state.stiffness, softer)
        if heavier:
            _, theta_dot, theta_ddot = reference.sample(np.array([state.t]))
            found = self._axes.learn(theta_dot[0], theta_ddot[0], state.d, inertia)
            share = follow_steps(share, found, heavier)
        self.steps = _told(stiffness), _told(share)

    def errors(self, steps: Steps) -> tuple[Array, Array]:
        """Return what steps stand for: relative errors of the stiffness, and of the inertia [1]."""
        stiffness, inertia = (np.array(at) * size for at, size in zip(steps, self._sizes, strict=True))
        return stiffness, inertia

    def not_explained(self, d: Array, steps: Steps, inertia: Array) -> Array:
        """Return the torque ``d`` less what axes heavier by these steps feel of the motion, (n,)."""
        if not steps[1]:
            return d
        return self._axes.not_explained(d, self.errors(steps)[1] * inertia)


def follow_steps(at: tuple[int, ...], learned: Array, size: float) -> tuple[int, ...]:
    """Return the steps that stand for what was learned.

    Args:
        at: The present ones; of another length where there are none yet.
        learned: Relative errors [1], (n,); what is not a number changes nothing.
        size: Of a step [1].
    """
    now = at if len(at) == learned.size else (0,) * learned.size
    wanted = (np.clip(learned, LOWEST, HIGHEST) / size).tolist()
    return tuple(round(w) if abs(w - k) > LEAVE else k for w, k in zip(wanted, now, strict=True))


def _told(steps: tuple[int, ...]) -> tuple[int, ...]:
    """Return the steps, or none where nothing was learned: that is the model as it is."""
    return steps if any(steps) else ()
