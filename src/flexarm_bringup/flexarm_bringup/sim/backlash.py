"""Play of gears: springs that bear nothing in a gap, by a dead zone that is exact [Nordin2002].

With delta and delta' of the spring, its total play b, stiffness k and damper d, what it bears is::

    tau = 0                                            |delta| <= b/2: the teeth do not touch
    tau = s max(0, k (|delta| - b/2) + d s delta')     else, s = sign(delta): they push and never pull

The damper acts in contact alone. The arm's equations have springs without play (tau = k delta + d delta');
what that is too much is given back as a force ("released") by both integrators. Without dampers each contact
costs O(h^2), in the explicit scheme, too; where a damper is, its force jumps as the teeth meet, which costs
O(h). Damping that is described as a ratio belongs to modes, not to a spring: it goes on in the gap.

A tooth that goes deep within one step has energy that nobody gave it. What stands at a gear may be light, so
steps are short beside its own oscillation on the teeth, w = sqrt(k (M^-1)_ii): ``steps_for_teeth``. The 6R
without losses and with 1 arcmin of play then gains 0.1 percent in a second; in the steps of its served modes
it gained 100 times what it had.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from flexarm_model.manipulator.description import AXES, Joint, ManipulatorConfig
from flexarm_model.served.linearize import constraint_stiffness, find_equilibrium
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]

LOADED = 1e-6  # of the largest force at rest: a spring that bears less lies in the middle of its gap
AT_REST = 1e-10  # unbalanced force at rest, relative to the largest one
MAX_ITERATIONS = 20
TEETH = 1.0  # rad that what stands at a gear turns on its teeth in a step; half of it halves the error
PARALLEL = 1e-6  # how far the cosine between the axes of a motor and its gear may be from one


@dataclass(frozen=True)
class Gaps:
    """Springs with play.

    Attributes:
        index: Where they stand in q, (k,).
        half: Half of their play [rad or m], (k,).
        stiffness: In contact [N m/rad or N/m], (k,).
        damping: In contact [N m s/rad or N s/m], (k,).
    """

    index: NDArray[np.int64]
    half: Array
    stiffness: Array
    damping: Array

    def released(self, delta: Array, rate: Array) -> tuple[Array, Array, Array]:
        """Return by how much springs without play bear too much, and what of that follows delta and delta'.

        Args:
            delta: Deflection of the springs [rad or m], (k,).
            rate: Its rate, (k,).

        Returns:
            Force [N m or N], stiffness and damping, (k,) each.
        """
        side = np.sign(delta)
        push = self.stiffness * (abs(delta) - self.half) + self.damping * side * rate
        is_free = (abs(delta) <= self.half) | (push <= 0.0)
        stiffness, damping = np.where(is_free, self.stiffness, 0.0), np.where(is_free, self.damping, 0.0)
        held = np.where(is_free, 0.0, side * self.stiffness * self.half)
        return stiffness * delta + damping * rate + held, stiffness, damping

    def expression(self, q: ca.SX, v: ca.SX) -> ca.SX:
        """Return the released force on all coordinates, (n_q,), of all of them, (n_q,) each."""
        force = ca.SX.zeros(q.numel())
        for i, half, k, d in zip(self.index.tolist(), self.half, self.stiffness, self.damping, strict=True):
            side = ca.sign(q[i])
            push = k * (ca.fabs(q[i]) - half) + d * side * v[i]
            is_free = ca.logic_or(ca.fabs(q[i]) <= half, push <= 0.0)
            force[i] = ca.if_else(is_free, k * q[i] + d * v[i], side * k * half)
        return force


def gaps_of(tree: ReducedTree) -> Gaps:
    """Return the springs with play of an arm; k = 0 of most."""
    found = [(i, axis) for i, axis in enumerate(tree.axes) if axis.backlash]
    return Gaps(
        np.array([i for i, _ in found], dtype=np.int64),
        np.array([axis.backlash / 2 for _, axis in found]),
        np.array([axis.stiffness for _, axis in found]),
        np.array([axis.damping for _, axis in found]),
    )


def steps_for_teeth(tree: ReducedTree, dt: float) -> int:
    """Return how many integration steps a period [s] needs at least for the teeth of its gears; 1 without."""
    gaps, q = gaps_of(tree), tree.loops.home
    if not gaps.index.size:
        return 1
    N = tree.motions_within(q)
    rows = N[gaps.index]
    mobility = np.einsum("ij,ji->i", rows, np.linalg.solve(N.T @ tree.mass_matrix(q) @ N, rows.T))
    return int(np.ceil(dt * np.sqrt(np.max(gaps.stiffness * mobility)) / TEETH))


def rest_at_home(tree: ReducedTree, gaps: Gaps) -> Array:
    """Return the coordinates at rest at the home pose, (n_q,), each gear on the side to which it is loaded.

    One that bears nothing lies in the middle of its gap.

    Raises:
        PoseError: Newton's iteration does not settle without play.
        ClosureError: The loops do not close at this pose.
        ValueError: It does not settle with play.
    """
    q, force = find_equilibrium(tree, tree.config.home)
    if not gaps.index.size:
        return q
    free, offset = np.setdiff1d(np.arange(tree.n_q), tree.actuated), np.zeros(tree.n_q)
    load = gaps.stiffness * q[gaps.index]
    largest = max(1.0, abs(tree.linearisation(q)[3]).max())
    offset[gaps.index] = np.sign(load) * (abs(load) > LOADED * largest) * gaps.stiffness * gaps.half
    for _ in range(MAX_ITERATIONS):
        _, _, K, f = tree.linearisation(q)
        c, G = tree.constraints(q)
        unbalanced = np.concatenate([(f - offset + G.T @ force)[free], c])
        if abs(unbalanced).max() <= AT_REST * largest:
            return q
        K_free = (K + constraint_stiffness(tree, q, force))[np.ix_(free, free)]
        loops = np.zeros((tree.n_c, tree.n_c))
        step = np.linalg.solve(np.block([[K_free, G[:, free].T], [G[:, free], loops]]), -unbalanced)
        q[free] += step[: free.size]
        force = force + step[free.size :]
    raise ValueError(f"'{tree.config.name}': does not come to rest with the play of its gears")


def find_gears(config: ManipulatorConfig) -> set[str]:
    """Return the names "joint.axis" of the gears: springs at the node that a motor moves, along its axis."""
    joints = (*config.joints, *config.closures)
    moved = [(joint.child, axis.name) for joint in joints for axis in joint.axes if axis.actuated]
    return {
        f"{joint.name}.{axis.name}"
        for joint in joints
        for axis in joint.axes
        if axis.stiffness and not axis.actuated
        if any(node == joint.parent and _is_along(motor, axis.name, joint) for node, motor in moved)
    }


def _is_along(motor: str, spring: str, joint: Joint) -> bool:
    """Return whether the axis of a motor at the joint's parent node is that of a spring of the joint."""
    if motor[0] != spring[0] or joint.placement[:3, 3].any():
        return False
    cosine = joint.placement[AXES.index(motor) % 3, AXES.index(spring) % 3]
    return bool(abs(cosine) >= 1.0 - PARALLEL)
