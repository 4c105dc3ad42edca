"""Trajectories from messages, with what their points leave out.

Beside the other conversions because of the spline, whose library takes as long to load as a guard.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from trajectory_msgs.msg import JointTrajectory

from flexarm_model.conversions import NS_PER_S, stamp_to_ns
from flexarm_model.motion.trajectory import Trajectory

Array = NDArray[np.float64]
LONGEST = 3600  # s that one motion may take


class TrajectoryMessageError(ValueError):
    """A trajectory cannot be followed; the text says why."""


def trajectory_from_msg(msg: JointTrajectory, names: Sequence[str], epoch_ns: int) -> Trajectory:
    """Return the motion of the axes ``names``, in this order whatever that of the message is.

    Without accelerations they are those of the cubics between the points; without velocities these are those
    of the spline through them (`Trajectory.through`).

    Args:
        msg: The message.
        names: Actuated axes, "joint.axis".
        epoch_ns: Stamp that is time zero [ns].

    Raises:
        TrajectoryMessageError: Names, lengths, times or numbers do not fit, or it is too long.
    """
    order = _order(msg.joint_names, names)
    start = stamp_to_ns(msg.header.stamp) - epoch_ns
    since = [stamp_to_ns(point.time_from_start) for point in msg.points]
    if since and max(since) > LONGEST * NS_PER_S:
        raise TrajectoryMessageError(f"it takes {max(since) * 1e-9:g} s, at most {LONGEST} s are allowed")
    theta, theta_dot, theta_ddot = (
        _points(msg, name, order) for name in ("positions", "velocities", "accelerations")
    )
    if theta is None:
        raise TrajectoryMessageError(f"positions: every point needs {len(names)} numbers")
    try:
        motion = Trajectory.through(np.array([start + ns for ns in since]) * 1e-9, theta, theta_dot)
        return (
            motion if theta_ddot is None else replace(motion, theta_ddot=theta_ddot, theta_ddot_before=None)
        )
    except ValueError as error:
        raise TrajectoryMessageError(str(error)) from None


def _order(told: Sequence[str], names: Sequence[str]) -> list[int]:
    """Return where each of the axes stands in the message."""
    if len(told) != len(names) or set(told) != set(names):
        shown = list(told[: len(names) + 1])
        more = f" and {len(told) - len(shown)} more" if len(told) > len(shown) else ""
        raise TrajectoryMessageError(f"joint_names are {shown}{more}; expected {list(names)}, in any order")
    return [list(told).index(name) for name in names]


def _points(msg: JointTrajectory, name: str, order: Sequence[int]) -> Array | None:
    """Return one quantity of all points, (k, n_theta); None where no point has it."""
    rows = [list(getattr(point, name)) for point in msg.points]
    if not any(rows):
        return None
    if any(len(row) != len(order) for row in rows):
        raise TrajectoryMessageError(f"{name}: every point needs {len(order)} numbers, or none has any")
    return np.array([[row[i] for i in order] for row in rows])
