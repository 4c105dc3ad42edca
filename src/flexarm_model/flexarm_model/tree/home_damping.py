"""Damping ratios hold at the home of the description, wherever the arm starts."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.tree.closure import Loops, find_loops, null_space
from flexarm_model.tree.closure_rows import ClosureRows
from flexarm_model.tree.coordinates import Coordinates, assumed_home
from flexarm_model.tree.modal_damping import Losses, modal_damping

Array = NDArray[np.float64]


def home_damping(
    config: ManipulatorConfig,
    at: Coordinates,
    rows: ClosureRows,
    loops: Loops,
    mass: ca.Function,
    stiffness: tuple[Array, Losses],
) -> Array:
    """Return the damping that the ratios and rates of bodies and springs mean, (n_q, n_q).

    Args:
        config: The manipulator.
        at: Its coordinates.
        rows: Of its loops.
        loops: Closed where the arm starts.
        mass: q -> M(q).
        stiffness: Of springs and bodies, (n_q, n_q), and what its parts lose.

    Raises:
        ClosureError: The loops do not close at home.
        ValueError: A motion has no mass; names its coordinates.
    """
    K, losses = stiffness
    if not losses.any():
        return np.zeros_like(K)
    home = loops.home
    if config.damped_at is not None:
        described = assumed_home(replace(config, home=config.damping_pose), at)
        home = find_loops(rows, described, at.loose_axes, at.sprung_axes, config.name).home
    G = rows.near(home)[1][loops.rows]
    Z = null_space(G, at.actuated, f"{config.name}: the home pose")[:, len(at.actuated) :]
    return modal_damping(np.array(mass(home)), K, losses, Z, at.names)
