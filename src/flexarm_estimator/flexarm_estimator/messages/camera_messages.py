"""Reads what a camera or tracker says of the tip: its pose in the base's frame, or the part that it sees."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from flexarm_estimator.measurement import Measurement
from flexarm_estimator.messages.covariances import CovarianceReader
from flexarm_estimator.messages.readings import Reading, Refusal
from flexarm_model.manipulator.sensor_kinds import POSE_CHANNELS, ROTATION
from flexarm_model.manipulator.sensor_spec import SensorSpec

BASE_FRAME = "base"
_UNIT_TOLERANCE = 0.05  # of the norm of a quaternion; drivers round, but not that much


class CameraReader:
    """Reads the messages of one camera (geometry_msgs/PoseWithCovarianceStamped)."""

    def __init__(self, spec: SensorSpec) -> None:
        """Know what it sees."""
        self._name, self._covariances = spec.name, CovarianceReader(spec)
        self._seen = [POSE_CHANNELS.index(channel) for channel in spec.channels]
        self._sees_rotation = bool(set(spec.channels) & set(ROTATION))

    def read(self, msg: Any, t: float) -> Reading:
        """Return the sample of a message stamped ``t`` [s]; what it does not see is not looked at."""
        if msg.header.frame_id != BASE_FRAME:
            reason = f"frame '{msg.header.frame_id}' is not '{BASE_FRAME}'"
            return Reading([], [Refusal(self._name, reason)])
        position, q = msg.pose.pose.position, msg.pose.pose.orientation
        norm = math.sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w)
        if self._sees_rotation and not abs(norm - 1.0) <= _UNIT_TOLERANCE:  # also NaN
            return Reading([], [Refusal(self._name, f"quaternion has norm {norm:.3g}")])
        pose = [position.x, position.y, position.z, *_rotation_vector(q.x, q.y, q.z, q.w)]
        told = np.asarray(msg.pose.covariance, dtype=np.float64).tolist()
        if len(self._seen) < len(pose):
            pose = [pose[i] for i in self._seen]
            told = [told[len(POSE_CHANNELS) * i + j] for i in self._seen for j in self._seen]
        return Reading([Measurement(self._name, t, np.array(pose), self._covariances.pick(told))])


def _rotation_vector(x: float, y: float, z: float, w: float) -> tuple[float, float, float]:
    """Return axis times angle in [-pi, pi] of a quaternion that need not be exactly of unit length."""
    sine = math.sqrt(x * x + y * y + z * z)
    if sine == 0.0:
        return 0.0, 0.0, 0.0
    scale = 2.0 * math.atan2(sine, abs(w)) / sine * (1.0 if w >= 0.0 else -1.0)
    return x * scale, y * scale, z * scale
