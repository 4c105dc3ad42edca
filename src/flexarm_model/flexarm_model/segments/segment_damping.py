"""What the damping ratios and rates of beams and axes mean in the segment tree: of the modes at home."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from flexarm_model.manipulator.body_spec import Beam
from flexarm_model.manipulator.loop_joints import passive_axes_outside_loops
from flexarm_model.segments.segment_loops import null_space
from flexarm_model.tree.modal_damping import Losses, modal_damping
from flexarm_model.tree.rest import come_to_rest

if TYPE_CHECKING:
    from flexarm_model.segments.segment_tree import SegmentTree

Array = NDArray[np.float64]


def segment_damping(tree: SegmentTree) -> Array:
    """Return the damping that ratios and rates mean, (n_q, n_q).

    Raises:
        ClosureError: The loops do not close at home.
        ValueError: A motion has no mass; names its coordinates.
    """
    losses = _losses(tree)
    if not losses.any():
        return np.zeros((tree.n_q, tree.n_q))
    home, e = _home(tree), np.setdiff1d(np.arange(tree.n_q), tree.actuated)
    Z = np.zeros((tree.n_q, e.size))
    Z[e, np.arange(e.size)] = 1.0
    Z = Z @ null_space(tree.loops.jacobian(home)[:, e])
    names = [f"segment coordinate {i}" for i in range(tree.n_q)]
    for name, index in tree.axes.items():
        names[index] = name
    return modal_damping(tree.mass_matrix(home), tree.K, losses, Z, names)


def _losses(tree: SegmentTree) -> Losses:
    """Return what beams and springs lose."""
    ratio, rate = np.zeros(tree.n_q), np.zeros(tree.n_q)
    for name, springs in tree.springs.items():
        beam = tree.config.bodies[name]
        assert isinstance(beam, Beam)
        own = [index for index, _, _ in springs]
        ratio[own], rate[own] = beam.damping_ratio, beam.damping_rate
    for name, axis in tree.config.axes.items():
        ratio[tree.axes[name]] = axis.damping_ratio
    return Losses(tree.K * ratio, tree.K * rate)


def _home(tree: SegmentTree) -> Array:
    """Return the home pose, beams unbent, axes with neither motor nor loop where they rest, (n_q,)."""
    home = tree.close(tree.config.damping_pose)
    passive = np.array([tree.axes[name] for name in passive_axes_outside_loops(tree.config)], dtype=int)
    if not passive.size:
        return home

    def linearisation(q: Array) -> tuple[Array, ...]:
        """Return mass, damping, stiffness, and the forces on the passive axes alone."""
        own = np.zeros(q.size)
        own[passive] = tree.inverse_dynamics(q, 0 * q, 0 * q)[passive]
        return tree.mass_matrix(q), tree.D, tree.stiffness(q), own

    rest = come_to_rest(linearisation, home, passive)
    return home if rest is None else rest
