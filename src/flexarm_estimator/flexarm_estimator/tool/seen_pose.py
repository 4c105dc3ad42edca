"""What a camera says of a pose: the channels that it sees, disturbed in the world's axes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.tool.rotation_log import exp_rotation, log_rotation
from flexarm_model.manipulator.sensor_kinds import POSE_CHANNELS

Array = NDArray[np.float64]


def seen_pose(T: Array, channels: Sequence[str], noise: Array) -> Array:
    """Return position [m] and rotation vector [rad] of a pose, as far as they are seen, (m,).

    Args:
        T: Pose, (4, 4).
        channels: What is seen, out of ``POSE_CHANNELS`` in their order.
        noise: Of what is seen, (m,).
    """
    seen = [POSE_CHANNELS.index(channel) for channel in channels]
    off = np.zeros(len(POSE_CHANNELS))
    off[seen] = noise
    turned = log_rotation(exp_rotation(off[3:]).dot(T[:3, :3]))
    return np.concatenate([T[:3, 3] + off[:3], turned])[seen]
