"""Where the tip is, and axes that bring it somewhere: the described arm at rest, sag and all.

The inverse starts from the arm with nothing bent, which is quick, and ends with the arm as it settles under
springs and gravity with the axes held (`resting_mechanism`), so that the tip comes to rest at the goal.

Newton's method ends at the nearest place where the error cannot fall, which is often no solution. So the arm
with nothing bent is looked at from where it is, from home, and then from places all over its ranges. What it
misses by far no bending mends; to find that out takes no longer than a guard waits for a command.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.state import ArmState
from flexarm_model.kinematics.body_mechanism import held_mechanism, resting_mechanism
from flexarm_model.kinematics.numeric import InverseSettings, Mechanism, solve_inverse
from flexarm_model.kinematics.refusals import ConvergenceError
from flexarm_model.numeric.rotation import rotation_vector
from flexarm_model.served.linearize import PoseError
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.closure_error import ClosureError
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
EXACT = InverseSettings(distance=1e-7, angle=1e-6, iterations=60)  # m, rad
ROUGH = InverseSettings(distance=1e-5, angle=1e-4, iterations=30)  # the sag is not in it
BRIEF = InverseSettings(distance=1e-5, angle=1e-4, iterations=12)  # from one of many starts
STARTS = 6  # poses from which a solution is looked for where those near and at home lead to none
FARTHEST = 1.5  # of the distance that the tip has from the middle of those poses: beyond it, nobody looks
BENDS = 0.05  # of it, by which what bends may reach further
NEAREST = 1.001  # of what is left at the nearest point: asked for again, it is found


def angle_with(distance: float) -> float:
    """Return the turn of the tip [rad] that a solution weighs as much as a distance [m]."""
    return distance / EXACT.length


@dataclass(frozen=True)
class TipGoal:
    """What is asked of the tip.

    Attributes:
        pose: ``T_world_tip``, (4, 4).
        with_orientation: Whether its orientation counts.
        duration: Of the motion [s]; 0: as short as the limits allow.
        tolerance: How far from it the tip may come to rest [m].
    """

    pose: Array
    with_orientation: bool = False
    duration: float = 0.0
    tolerance: float = 1e-4

    @property
    def angle(self) -> float:
        """How far it may come to rest turned away [rad]."""
        return angle_with(self.tolerance)


class TipKinematics:
    """The tip of one description.

    Attributes:
        tree: Its dynamics.
    """

    def __init__(self, tree: ReducedTree) -> None:
        """Prepare; the first solution would otherwise wait for compilers."""
        self.tree = tree
        self._held, self._resting = held_mechanism(tree), resting_mechanism(tree)
        self._home = np.array(tree.config.home, float)
        self._starts, tips = _spread(tree, self._held)
        self._middle = tips.mean(axis=0)
        self._reach = float(np.linalg.norm(tips - self._middle, axis=1).max())
        self._resting.jacobian(self._home)

    def under(self, parameters: Mapping[str, float]) -> TipKinematics:
        """Return the tip of the same arm with other values of its named parameters [SI]: it sags otherwise.

        Raises:
            ParameterRangeError: There is no such parameter, or a law does not reach its value.
        """
        other = copy(self)
        other.tree = self.tree.under(parameters)
        other._resting = resting_mechanism(other.tree)
        return other

    def at(self, q: Array) -> Array:
        """Return where the tip is at coordinates of the dynamics tree [m], (3,)."""
        return np.asarray(self.tree.tip_pose(q)[:3, 3])

    def position(self, model: ReducedModel, state: ArmState) -> Array:
        """Return where the tip is in a state of the served model [m], (3,)."""
        xi = np.concatenate([state.theta, state.eta])
        return self.at(model.q0 + model.Phi @ (xi - model.xi0))

    def at_rest(self, theta: Array) -> Array:
        """Return where the tip comes to rest with the axes held at ``theta`` [m], (3,)."""
        return np.asarray(self._resting.pose(theta)[:3, 3])

    def beside(self, goal: TipGoal, theta: Array) -> tuple[float, float]:
        """Return how far from a goal the tip comes to rest [m], and how far turned [rad] if that counts."""
        pose = np.asarray(self._resting.pose(theta))
        turn = rotation_vector(goal.pose[:3, :3] @ pose[:3, :3].T) if goal.with_orientation else np.zeros(3)
        return float(np.linalg.norm(pose[:3, 3] - goal.pose[:3, 3])), float(np.linalg.norm(turn))

    def solve(self, goal: TipGoal, near: Array) -> Array:
        """Return axes that bring the tip to rest at the goal, near some axes if possible, (n_theta,).

        Raises:
            MotionError: It is out of reach by more than the tolerance, or the angle that goes with it; says
                by how much.
        """
        attempts = _Attempts()
        for start in self._unbent(goal, near, attempts):
            with attempts.noting():
                return _inverse(self._resting, goal, start, EXACT)
        if attempts.distance <= BENDS * self._reach or not attempts.left:
            for start in (near, self._home):
                with attempts.noting():
                    return _inverse(self._resting, goal, start, EXACT)
        raise MotionError(attempts.refusal(goal))

    def _unbent(self, goal: TipGoal, near: Array, attempts: _Attempts) -> Iterator[Array]:
        """Give axes at which the arm with nothing bent is at a goal; note what is left from other starts."""
        for start in (near, self._home):
            with attempts.noting():
                yield _inverse(self._held, goal, start, ROUGH)
        if np.linalg.norm(goal.pose[:3, 3] - self._middle) > FARTHEST * self._reach:
            return
        size = np.maximum(np.ptp(self._starts, axis=0), 1e-9)
        for start in sorted(self._starts, key=lambda pose: float(np.linalg.norm((pose - near) / size))):
            with attempts.noting():
                yield _inverse(self._held, goal, start, BRIEF)


class _Attempts:
    """What is left of a goal from several starts."""

    def __init__(self) -> None:
        self.left: list[ConvergenceError] = []
        self._why = ""

    @contextmanager
    def noting(self) -> Iterator[None]:
        """Go on where no solution is found, and note why."""
        try:
            yield
        except ConvergenceError as error:
            self.left.append(error)
        except (PoseError, ClosureError) as error:
            self._why = str(error)

    @property
    def distance(self) -> float:
        """How far the tip stayed away from the goal at least [m]."""
        return min((error.distance for error in self.left), default=float("inf"))

    def refusal(self, goal: TipGoal) -> str:
        """Return what to say of a goal that was not reached."""
        if not self.left:
            return f"the arm finds no rest there: {self._why}"
        best = min(self.left, key=lambda error: error.distance + EXACT.length * error.angle)
        left, allowed = f"{1e3 * best.distance:.3g} mm", f"{1e3 * goal.tolerance:.3g} mm"
        if goal.with_orientation:
            left, allowed = f"{left} and {best.angle:.3g} rad", f"{allowed} and {goal.angle:.3g} rad"
        return f"out of reach: the tip stays {left} away, {allowed} are allowed"


def _spread(tree: ReducedTree, held: Mechanism) -> tuple[Array, Array]:
    """Return poses all over the ranges of the axes, always the same, (k, n_theta), and the tip there (k, 3).

    Home and the named poses are among them; loops that do not close at a place are tried nearer to home.
    """
    config, axes = tree.config, tree.config.actuated.values()
    low, high = (np.array([getattr(axis, end) for axis in axes], float) for end in ("lower", "upper"))
    low, high = np.maximum(low, config.home - np.pi), np.minimum(high, config.home + np.pi)
    shares = np.random.default_rng(0).uniform(0.05, 0.95, (4, STARTS, low.size))
    kept = np.array([1.0, 0.75, 0.5, 0.25])[:, None, None]
    far = config.home + kept * (low + shares * (high - low) - config.home)
    named = [np.array(config.home), *map(np.array, config.poses.values())]
    found: list[tuple[Array, Array]] = []
    for pose in (*named, *far.reshape(-1, low.size)):
        if len(found) == len(named) + STARTS:
            break
        with suppress(ClosureError):
            found.append((pose, np.array(held.pose(pose)[:3, 3])))
    poses, tips = zip(*found, strict=True)
    return np.array(poses), np.array(tips)


def _inverse(mechanism: Mechanism, goal: TipGoal, start: Array, settings: InverseSettings) -> Array:
    """Return the axes of the goal, or of the nearest point where that is within the tolerance."""
    settings = replace(settings, full_pose=goal.with_orientation)
    try:
        return solve_inverse(mechanism, goal.pose, start, settings).theta
    except ConvergenceError as error:
        if error.distance > goal.tolerance or error.angle > max(goal.angle, settings.angle):
            raise
        nearest = replace(
            settings,
            distance=max(NEAREST * error.distance, settings.distance),
            angle=max(NEAREST * error.angle, settings.angle),
        )
    return solve_inverse(mechanism, goal.pose, start, nearest).theta
