"""The moves of a comparison: the way of the axes, the profile it is given with, the models at its end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.compare_laws.along_way import AlongWay, along_way
from flexarm_bringup.compare_laws.sampled import speed_share
from flexarm_bringup.static_arm import StaticArm
from flexarm_bringup.tasks.task import Task
from flexarm_controller.limits import Limits, limits_of
from flexarm_controller.open_loop.axis_motion import Motion, PacedMotion, Way
from flexarm_model.served.linearize import linearize
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
ROUNDING = 1e-9  # of a limit of velocity
SMALLEST_WAY = 1e-5  # rad or m; less is no way but what is left of solving for the pose


@dataclass(frozen=True)
class ComparedLeg:
    """One move.

    Attributes:
        name: Of the move.
        given: The motion as the moves file has it, the worst profile.
        model: Served at the goal, where the vibration is that is left.
        middle: Served half-way between start and goal.
        along: Models along the way, by which torque and strain are predicted.
        limits: Of the arm.
        dt: Control period [s].
    """

    name: str
    given: PacedMotion
    model: ReducedModel
    middle: ReducedModel
    along: AlongWay
    limits: Limits
    dt: float

    @property
    def start(self) -> Array:
        """Where it starts [rad or m], (n_theta,)."""
        return np.asarray(self.given.way.theta[0])

    @property
    def goal(self) -> Array:
        """Where it ends [rad or m], (n_theta,)."""
        return np.asarray(self.given.way.theta[-1])

    @property
    def goes_somewhere(self) -> bool:
        """Whether it ends elsewhere than it starts."""
        return bool(abs(self.goal - self.start).max() > SMALLEST_WAY)

    def peak(self, motion: Motion) -> Array:
        """Return the largest torque a motion asks of an arm that does not vibrate [N m or N], (n_theta,)."""
        return np.asarray(abs(self.along.torque(motion)).max(axis=0))

    def hold(self, motion: Motion) -> Array:
        """Return the largest torque that holds such an arm anywhere on its way [N m or N], (n_theta,)."""
        return np.asarray(abs(self.along.holding(motion)).max(axis=0))

    def excess(self, motion: Motion) -> str:
        """Return which limit a motion is beyond, "velocity", "torque" or "strain"; empty for none."""
        if (speed_share(motion, self.limits, self.dt) > 1.0 + ROUNDING).any():
            return "velocity"
        if (self.peak(motion) > self.limits.effort).any():
            return "torque"
        return "strain" if self.along.strain_share(motion) > 1.0 else ""

    def is_allowed(self, motion: Motion) -> bool:
        """Tell whether an arm that is led exactly keeps the limits of velocity, torque and strain."""
        return not self.excess(motion)


def compared_legs(tree: ReducedTree, task: Task, home: Array) -> tuple[ComparedLeg, ...]:
    """Work out the moves of a comparison from the axes at ``home``, (n_theta,).

    Raises:
        ValueError: The arm cannot do a move; says which and why.
    """
    arm, dt, theta = StaticArm(tree), 1.0 / tree.config.rate_hz, home
    limits, legs = limits_of(tree.config), []
    for name, move in (task.compare.moves or task.moves).items():
        try:
            motion = move.plan(arm, theta, dt)
        except ValueError as error:
            raise ValueError(f"move '{name}': {error}") from error
        share, first = np.unique(move.profile.sample(motion.t)[0], return_index=True)
        way = Way(share, motion.theta[first])
        goal = motion.theta[-1]
        models = linearize(tree, goal), linearize(tree, (theta + goal) / 2)
        along = along_way(tree, way, limits, dt)
        legs.append(ComparedLeg(name, PacedMotion(way, move.profile), *models, along, limits, dt))
        theta = goal
    return tuple(legs)
