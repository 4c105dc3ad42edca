"""Damping ratios hold at the home of the description, wherever the arm starts.

There bodies are unbent, loops closed, and axes with neither motor nor loop stand where weight and springs
let them rest.
"""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.manipulator.loop_joints import passive_axes_outside_loops
from flexarm_model.tree.closure import Loops, null_space
from flexarm_model.tree.closure_rows import ClosureRows
from flexarm_model.tree.coordinates import Coordinates
from flexarm_model.tree.modal_damping import Losses, modal_damping
from flexarm_model.tree.rest import come_to_rest
from flexarm_model.tree.start_closing import described_home

Array = NDArray[np.float64]


def home_damping(
    config: ManipulatorConfig,
    at: Coordinates,
    rows: ClosureRows,
    loops: Loops,
    inertia: tuple[ca.Function, Callable[[], ca.Function]],
    stiffness: tuple[Array, Losses],
) -> Array:
    """Return the damping that the ratios and rates of bodies and springs mean, (n_q, n_q).

    Args:
        config: The manipulator.
        at: Its coordinates.
        rows: Of its loops.
        loops: Closed where the arm starts.
        inertia: q -> M(q), and what makes q -> forces of weight, (n_q,), and their derivative, (n_q, n_q).
        stiffness: Of springs and bodies, (n_q, n_q), and what its parts lose.

    Raises:
        ClosureError: The loops do not close at home.
        ValueError: A motion has no mass; names its coordinates.
    """
    K, losses = stiffness
    if not losses.any():
        return np.zeros_like(K)
    home = loops.home if config.damped_at is None else described_home(config, at, rows)
    mass = inertia[0]
    if passive := [at.names.index(name) for name in passive_axes_outside_loops(config)]:
        home = _let_rest(home, np.array(passive), mass, inertia[1](), K)
    G = rows.near(home)[1][loops.rows]
    Z = null_space(G, at.actuated, f"{config.name}: the home pose")[:, len(at.actuated) :]
    return modal_damping(np.array(mass(home)), K, losses, Z, at.names)


def _let_rest(q: Array, e: Array, mass: ca.Function, weight: ca.Function, K: Array) -> Array:
    """Return q (n_q,) with the axes e where weight and springs K let them rest; q itself if nothing does."""

    def linearisation(q: Array) -> tuple[Array, ...]:
        """Return mass, damping, stiffness, and the forces on the axes e alone: others set no scale."""
        (force, slope), own = weight(q), np.zeros(q.size)
        own[e] = (K @ q + np.array(force).ravel())[e]
        return np.array(mass(q)), np.zeros_like(K), K + np.array(slope), own

    rest = come_to_rest(linearisation, q, e)
    return q if rest is None else rest
