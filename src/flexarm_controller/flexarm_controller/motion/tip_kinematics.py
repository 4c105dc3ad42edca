"""Where the tip is, and axes that bring it somewhere: the described arm at rest, sag and all.

The inverse starts from the arm with nothing bent, which is quick, and ends with the arm as it settles under
springs and gravity with the axes held (`resting_mechanism`), so that the tip comes to rest at the goal.

Newton's method ends at the nearest place where the error cannot fall, which is often no solution. So the arm
with nothing bent is looked at from where it is, from home, and then from poses that have the tip near the
goal. What it misses by far no bending mends, and how the arm rests is dear: it is asked a few times only.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from copy import copy
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.guarding.joint_range import JointRange
from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.motion.tip_starts import Starts
from flexarm_controller.state import ArmState
from flexarm_model.kinematics.body_mechanism import held_mechanism, resting_mechanism
from flexarm_model.kinematics.numeric import InverseSettings, Mechanism, solve_inverse
from flexarm_model.kinematics.reach import reach_of
from flexarm_model.kinematics.refusals import ConvergenceError
from flexarm_model.numeric.rotation import rotation_vector
from flexarm_model.served.linearize import PoseError
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.closure_error import ClosureError
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
EXACT = InverseSettings(distance=1e-7, angle=1e-6, iterations=6)  # m, rad; 2 or 3 do from nothing bent
ROUGH = InverseSettings(distance=1e-5, angle=1e-4, iterations=30)  # the sag is not in it
BRIEF = InverseSettings(distance=1e-5, angle=1e-4, iterations=12)  # from one of many starts
RESTS = 2  # starts from which the rest is looked for: it costs a hundred times as much as with nothing bent
BENDS = 0.05  # of its reach, by which what bends may reach further
ALIKE = 1.1  # of what is left of a goal: so little more is not worth another way to hold the arm
INSIDE = 1.001  # of the band at the end of a range where the guard stops an axis: a goal is outside of it


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
        self._starts, self._reach = Starts(tree.config, self._held), reach_of(tree)
        self._resting.jacobian(self._home)

    def under(self, parameters: Mapping[str, float]) -> TipKinematics:
        """Return the tip of the same arm with other values of its named parameters [SI]: it sags otherwise.

        Raises:
            ParameterRangeError: There is no such parameter, or a law does not reach its value.
        """
        other = copy(self)
        other.tree = self.tree.under(parameters)
        low, high = self._held.lower, self._held.upper
        other._resting = replace(resting_mechanism(other.tree), lower=low, upper=high)
        return other

    def within(self, ranges: Sequence[JointRange]) -> TipKinematics:
        """Return the tip of the same arm with axes that keep out of the bands where a guard stops them.

        Args:
            ranges: Of every axis; empty for axes without ends.
        """
        other, held = copy(self), self._held
        band = INSIDE * np.array([known.band for known in ranges] or np.zeros(held.lower.size))
        middle = (held.lower + held.upper) / 2.0  # not a number where there are no ends
        low, high = np.fmin(held.lower + band, middle), np.fmax(held.upper - band, middle)
        other._held = replace(held, lower=low, upper=high)
        other._resting = replace(self._resting, lower=low, upper=high)
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
            MotionError: It is out of reach, or none were found, by more than the tolerance, or the angle that
                goes with it; says by how much.
        """
        attempts = _Attempts()
        for start in islice(self._unbent(goal, near, attempts), RESTS):
            with attempts.noting():
                return _inverse(self._resting, goal, start, EXACT)
        raise MotionError(self._refusal(goal, attempts))

    def _unbent(self, goal: TipGoal, near: Array, attempts: _Attempts) -> Iterator[Array]:
        """Give axes at which the arm with nothing bent is at a goal; at last those that come nearest.

        A tolerance counts at last alone: the first place within it may be far from a goal that can be met.
        """
        exact = replace(goal, tolerance=0.0)
        for start in (near, self._home):
            with attempts.noting():
                yield _inverse(self._held, exact, start, ROUGH)
        if not self._is_beyond(goal):
            length = EXACT.length if goal.with_orientation else 0.0
            for start in self._starts.near(goal.pose, length, near):
                attempts.others += 1
                with attempts.noting():
                    yield _inverse(self._held, exact, start, BRIEF)
        if not attempts.left:
            yield near
        elif attempts.best.distance <= BENDS * self._reach.radius + goal.tolerance:
            yield attempts.worth_bending(goal.tolerance).theta

    def _is_beyond(self, goal: TipGoal) -> bool:
        """Tell whether no axes whatever bring the tip as near to a goal as its tolerance."""
        return self._reach.missing(goal.pose[:3, 3]) > BENDS * self._reach.radius + goal.tolerance

    def _refusal(self, goal: TipGoal, attempts: _Attempts) -> str:
        """Return what to say of a goal that was not reached."""
        if not attempts.left:
            return f"the arm finds no rest there: {attempts.why}"
        best = attempts.best
        left, allowed = f"{1e3 * best.distance:.3g} mm", f"{1e3 * goal.tolerance:.3g} mm"
        if goal.with_orientation:
            left, allowed = f"{left} and {best.angle:.3g} rad", f"{allowed} and {goal.angle:.3g} rad"
        stays = f"stays {left} away, {allowed} are allowed"
        if self._is_beyond(goal):
            return f"out of reach: the tip {stays}"
        tried = f"here, home and {attempts.others} other poses"
        return f"no way found from {tried}: the nearest{self._ends(best.theta)} {stays}"

    def _ends(self, theta: Array) -> str:
        """Return which axes are at the ends of their ranges, in parentheses."""
        at = (theta <= self._held.lower) | (theta >= self._held.upper)
        names = [name for name, is_there in zip(self.tree.config.actuated, at, strict=True) if is_there]
        return f" (at the end of range: {', '.join(names)})" if names else ""


class _Attempts:
    """What is left of a goal from several starts.

    Attributes:
        left: Of those that ended somewhere.
        why: The last of the others did not.
        others: Number of starts beside here and home.
    """

    def __init__(self) -> None:
        self.left: list[ConvergenceError] = []
        self.why = ""
        self.others = 0

    @contextmanager
    def noting(self) -> Iterator[None]:
        """Go on where no solution is found, and note why."""
        try:
            yield
        except ConvergenceError as error:
            self.left.append(error)
        except (PoseError, ClosureError) as error:
            self.why = str(error)

    @property
    def best(self) -> ConvergenceError:
        """The one that came nearest, a turn counting by the size of a tool."""
        return min(self.left, key=_off)

    def worth_bending(self, tolerance: float) -> ConvergenceError:
        """Return the first within a tolerance [m] that came about as near as any; else the nearest."""
        near = [each for each in self.left if _off(each) <= ALIKE * _off(self.best)]
        return next((each for each in near if each.distance <= tolerance), self.best)


def _off(error: ConvergenceError) -> float:
    """Return what is left of a goal [m], a turn counting by the size of a tool."""
    return error.distance + EXACT.length * error.angle


def _inverse(mechanism: Mechanism, goal: TipGoal, start: Array, settings: InverseSettings) -> Array:
    """Return the axes of the goal, or of the nearest point where that is within the tolerance."""
    settings = replace(settings, full_pose=goal.with_orientation)
    try:
        return solve_inverse(mechanism, goal.pose, start, settings).theta
    except ConvergenceError as error:
        if error.distance > goal.tolerance or error.angle > max(goal.angle, settings.angle):
            raise
        return error.theta
