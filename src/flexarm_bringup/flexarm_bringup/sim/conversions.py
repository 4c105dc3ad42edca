"""Samples of the simulated sensors as ROS messages."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from flexarm_interfaces.msg import StrainArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import Imu, JointState

from flexarm_bringup.sim.sensor_simulator import Sample
from flexarm_model.conversions import floats, ns_to_stamp
from flexarm_model.description import ManipulatorConfig, SensorSpec

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Outgoing:
    """A message and the relative topic it goes to."""

    topic: str
    msg: Any


def samples_to_msgs(
    config: ManipulatorConfig, samples: Sequence[Sample], stamp_of: Callable[[int], int]
) -> list[Outgoing]:
    """Return the messages of all samples but the encoders', which ``joint_state_msg`` carries.

    Args:
        config: The manipulator.
        samples: What arrived at this tick.
        stamp_of: Stamp [ns] of a tick.
    """
    specs = {spec.name: spec for spec in config.sensors}
    return [
        _CONVERT[sample.kind](specs[sample.sensor], sample, stamp_of(sample.tick))
        for sample in samples
        if sample.kind in _CONVERT
    ]


def joint_state_msg(names: Sequence[str], position: Array, velocity: Array, effort: Sequence[float], stamp_ns: int) -> JointState:
    """Return the state of the actuated axes; ``effort`` is what acted until the stamp."""
    msg = JointState(name=list(names), position=floats(position), velocity=floats(velocity), effort=floats(effort))
    msg.header.stamp = ns_to_stamp(stamp_ns)
    msg.header.frame_id = "base"
    return msg


def applied_effort_msg(names: Sequence[str], effort: Sequence[float], stamp_ns: int) -> JointState:
    """Return the torque that acts from the stamp on."""
    msg = JointState(name=list(names), effort=floats(effort))
    msg.header.stamp = ns_to_stamp(stamp_ns)
    return msg


def _strain(spec: SensorSpec, sample: Sample, stamp_ns: int) -> Outgoing:
    msg = StrainArray(names=[spec.name], strain=floats(sample.y), standard_deviation=floats(spec.sigma))
    msg.header.stamp = ns_to_stamp(stamp_ns)
    msg.header.frame_id = spec.site
    return Outgoing("strain", msg)


def _imu(spec: SensorSpec, sample: Sample, stamp_ns: int) -> Outgoing:
    msg = Imu()
    msg.header.stamp = ns_to_stamp(stamp_ns)
    msg.header.frame_id = spec.site
    covariance = np.diag([-1.0, -1.0, -1.0])  # REP 145: -1 marks what is not measured
    for channel, value, sigma in zip(spec.channels, sample.y, spec.sigma, strict=True):
        setattr(msg.linear_acceleration, channel, float(value))
        covariance["xyz".index(channel), "xyz".index(channel)] = sigma**2
    msg.linear_acceleration_covariance = covariance.ravel()
    msg.angular_velocity_covariance[0] = msg.orientation_covariance[0] = -1.0
    return Outgoing(f"imu/{spec.name}", msg)


def _camera(spec: SensorSpec, sample: Sample, stamp_ns: int) -> Outgoing:
    msg = PoseWithCovarianceStamped()
    msg.header.stamp = ns_to_stamp(stamp_ns)
    msg.header.frame_id = "base"
    position, orientation = msg.pose.pose.position, msg.pose.pose.orientation
    position.x, position.y, position.z = map(float, sample.y[:3])
    quaternion = Rotation.from_rotvec(sample.y[3:]).as_quat()
    orientation.x, orientation.y, orientation.z, orientation.w = map(float, quaternion)
    msg.pose.covariance = np.diag(spec.sigma**2).ravel()
    return Outgoing("camera/pose", msg)


_CONVERT: dict[str, Callable[[SensorSpec, Sample, int], Outgoing]] = {
    "strain_gauge": _strain,
    "accelerometer": _imu,
    "camera": _camera,
}
