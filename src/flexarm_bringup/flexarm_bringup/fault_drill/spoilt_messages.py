"""Ways to spoil what sensors say: sizes, names, numbers that are none, covariances, frames."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

STRANGE = "nowhere"
NASTY = (math.nan, math.inf, -math.inf, 1e308, -1e308, 5e-324, 0.0, -1.0, 1e6)


def _spoil_joints(msg: Any, rng: np.random.Generator) -> bool:
    """Spoil joint states; returns whether they must be refused."""
    which = rng.integers(4)
    if which == 0:
        msg.position = []
    elif which == 1:
        msg.position = [*msg.position, 0.0]
    elif which == 2:
        msg.name = [STRANGE, *msg.name[1:]]
    else:
        msg.position = [float(rng.choice((math.nan, math.inf, 1e308)))] * len(msg.name)
    msg.effort = []
    return True


def _spoil_strain(msg: Any, rng: np.random.Generator) -> bool:
    which = rng.integers(4)
    if which == 0:
        msg.strain = []
    elif which == 1:
        msg.names = [STRANGE, *msg.names[1:]]
    elif which == 2:
        msg.strain = [float(rng.choice((math.nan, math.inf, 1.0)))] * len(msg.names)
    else:
        msg.standard_deviation = [float(rng.choice(NASTY))] * len(msg.names)
    return bool(which != 3)


def _spoil_imu(msg: Any, rng: np.random.Generator) -> bool:
    which = rng.integers(3)
    if which == 0:
        msg.header.frame_id = STRANGE
    elif which == 1:
        bad = float(rng.choice((math.nan, math.inf, 1e308)))
        msg.linear_acceleration.x = msg.linear_acceleration.y = msg.linear_acceleration.z = bad
    else:
        msg.linear_acceleration_covariance = rng.choice(NASTY, 9)
    return bool(which != 2)


def _spoil_camera(msg: Any, rng: np.random.Generator) -> bool:
    which, q = rng.integers(4), msg.pose.pose.orientation
    if which == 0:
        msg.header.frame_id = STRANGE
    elif which == 1:
        q.x = q.y = q.z = q.w = float(rng.choice((0.0, math.nan, 1e308)))
    elif which == 2:
        msg.pose.pose.position.x = float(rng.choice((math.nan, math.inf, 1e6)))
    else:
        msg.pose.covariance = rng.choice(NASTY, 36)
    return bool(which != 3)


SPOIL = {"joint_states": _spoil_joints, "strain": _spoil_strain, "imu": _spoil_imu, "camera": _spoil_camera}
