"""Where the tip is, and axes that bring it somewhere: the described arm at rest, sag and all.

The inverse starts from the arm with nothing bent, which is quick, and ends with the arm as it settles under
springs and gravity with the axes held (`resting_mechanism`), so that the tip comes to rest at the goal.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.state import ArmState
from flexarm_model.kinematics.body_mechanism import held_mechanism, resting_mechanism
from flexarm_model.kinematics.numeric import InverseSettings, Mechanism, solve_inverse
from flexarm_model.kinematics.refusals import ConvergenceError
from flexarm_model.served.linearize import PoseError
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.closure_error import ClosureError
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
EXACT = InverseSettings(distance=1e-7, angle=1e-6, iterations=60)  # m, rad
ROUGH = InverseSettings(distance=1e-5, angle=1e-4, iterations=60)  # the sag is not in it
NEAREST = 1.001  # of what is left at the nearest point: asked for again, it is found


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
        self._resting.jacobian(self._home)

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

    def solve(self, goal: TipGoal, near: Array) -> Array:
        """Return axes that bring the tip to rest at the goal, near some axes if possible, (n_theta,).

        Raises:
            MotionError: It is out of reach by more than the tolerance; says by how much.
        """
        best: ConvergenceError | None = None
        for start in (near, self._home):
            try:
                return self._solve(goal, start)
            except ConvergenceError as error:
                best = error if best is None or error.distance < best.distance else best
            except (PoseError, ClosureError) as error:
                refusal = str(error)
        if best is None:
            raise MotionError(f"the arm finds no rest there: {refusal}")
        raise MotionError(
            f"out of reach: the tip stays {1e3 * best.distance:.3g} mm and {best.angle:.3g} rad away, "
            f"{1e3 * goal.tolerance:.3g} mm are allowed"
        )

    def _solve(self, goal: TipGoal, start: Array) -> Array:
        with suppress(ConvergenceError):  # what bends may reach further
            start = _inverse(self._held, goal, start, ROUGH)
        return _inverse(self._resting, goal, start, EXACT)


def _inverse(mechanism: Mechanism, goal: TipGoal, start: Array, settings: InverseSettings) -> Array:
    """Return the axes of the goal, or of the nearest point where that is within the tolerance."""
    settings = replace(settings, full_pose=goal.with_orientation)
    try:
        return solve_inverse(mechanism, goal.pose, start, settings).theta
    except ConvergenceError as error:
        if error.distance > goal.tolerance or error.angle > settings.angle:
            raise
        nearest = replace(settings, distance=NEAREST * error.distance)
    return solve_inverse(mechanism, goal.pose, start, nearest).theta
