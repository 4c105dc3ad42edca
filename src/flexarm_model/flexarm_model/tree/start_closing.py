"""Where closing the loops begins: at home from the guesses, elsewhere on the way from home.

Most loops close in two ways at a pose, an elbow to either side. In which of them an arm is, its guesses say
of home alone; another pose is reached from there without opening a loop.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.tree.closure import close_from, find_loops
from flexarm_model.tree.closure_error import ClosureError
from flexarm_model.tree.closure_rows import ClosureRows
from flexarm_model.tree.coordinates import Coordinates, assumed_home

Array = NDArray[np.float64]
STEP = 0.1  # of an axis from one closing to the next [rad or m]


def closing_start(config: ManipulatorConfig, at: Coordinates, rows: ClosureRows) -> Array:
    """Return where closing the loops begins for the pose that an arm starts in, (n_q,).

    Args:
        config: The manipulator.
        at: Its coordinates.
        rows: Of its loops.

    Raises:
        ClosureError: The loops do not close at home.
    """
    start = assumed_home(config, at)
    if config.damped_at is None or not rows.names:
        return start
    movable = at.loose_axes, np.union1d(at.loose_axes, at.sprung_axes)
    q = described_home(config, at, rows)
    way = config.home - config.damping_pose
    count = int(np.ceil(abs(way).max() / STEP))
    try:
        for k in range(1, count + 1):
            q = q.copy()
            q[at.actuated] = config.damping_pose + k / count * way
            q = close_from(rows, q, movable, config.name)
    except ClosureError:  # not on the straight way: the guesses may lead there
        return start
    return q


def described_home(config: ManipulatorConfig, at: Coordinates, rows: ClosureRows) -> Array:
    """Return the coordinates with loops closed at the home of the description, (n_q,).

    Raises:
        ClosureError: They do not close there.
    """
    start = assumed_home(replace(config, home=config.damping_pose), at)
    return find_loops(rows, start, at.loose_axes, at.sprung_axes, config.name).home
