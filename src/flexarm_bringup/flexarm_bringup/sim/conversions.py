"""What the simulated hardware says and hears, as ROS messages."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from flexarm_interfaces.msg import StrainArray
from flexarm_interfaces.msg import Truth as TruthMsg
from geometry_msgs.msg import PoseWithCovarianceStamped
from sensor_msgs.msg import Imu, JointState

from flexarm_bringup.sim.drives import Drives
from flexarm_bringup.sim.rig import Truth
from flexarm_bringup.sim.sample import Sample
from flexarm_estimator.messages.sensor_messages import INERTIAL_FIELDS
from flexarm_model.conversions import floats, ns_to_stamp
from flexarm_model.manipulator.cameras import camera_topic
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.manipulator.imu import unit_of
from flexarm_model.manipulator.sensor_kinds import POSE_CHANNELS
from flexarm_model.manipulator.sensor_spec import SensorSpec
from flexarm_model.numeric.rotation import quaternion_from_vector

UNSEEN = 1e6  # m^2 or rad^2; variance that says that a camera does not see a channel


@dataclass(frozen=True)
class Outgoing:
    """A message and the relative topic it goes to."""

    topic: str
    msg: Any


def samples_to_msgs(
    config: ManipulatorConfig, samples: Sequence[Sample], stamp_of: Callable[[int], int]
) -> list[Outgoing]:
    """Return the messages of all samples but the encoders', which ``joint_state_msg`` carries.

    Gauges that speak at the same instant share a message.

    Args:
        config: The manipulator.
        samples: What arrived at this tick.
        stamp_of: Stamp [ns] of a tick.
    """
    specs = {spec.name: spec for spec in config.sensors}
    strains = [
        strain_msg(specs, together, stamp_of(tick) + late_ns)
        for (tick, late_ns), together in gauges(samples).items()
    ]
    return strains + [
        sample_msg(specs[sample.sensor], sample, stamp_of(sample.tick) + sample.late_ns)
        for sample in samples
        if sample.kind in _CONVERT
    ]


def gauges(samples: Sequence[Sample]) -> dict[tuple[int, int], list[Sample]]:
    """Return what strain gauges delivered, by their stamp: tick, and time after it [ns]."""
    by_stamp: dict[tuple[int, int], list[Sample]] = {}
    for sample in samples:
        if sample.kind == "strain_gauge":
            by_stamp.setdefault((sample.tick, sample.late_ns), []).append(sample)
    return by_stamp


def told_axes(drives: Drives) -> tuple[tuple[str, ...], list[float], list[float], list[float]]:
    """Return names, position, velocity and torque of the axes whose encoders spoke at this tick, SI."""
    motors = drives.motors
    read = [i for i, name in enumerate(drives.names) if name in motors.read]
    names = tuple(drives.names[i] for i in read)
    position, velocity = [motors.read[name] for name in names], [motors.velocity[i] for i in read]
    return names, position, velocity, [drives.acted[i] for i in read]


def joint_state_msg(drives: Drives, stamp_ns: int) -> JointState:
    """Return what the encoders tell: position, velocity; and the torque that acted until the stamp.

    An axis whose encoder was silent at this tick is left out.
    """
    names, position, velocity, effort = told_axes(drives)
    msg = JointState(name=list(names), position=floats(position), velocity=floats(velocity))
    msg.effort = floats(effort)
    msg.header.stamp = ns_to_stamp(stamp_ns)
    msg.header.frame_id = "base"
    return msg


def applied_effort_msg(names: Sequence[str], effort: Sequence[float], stamp_ns: int) -> JointState:
    """Return the torque that acts from the stamp on."""
    msg = JointState(name=list(names), effort=floats(effort))
    msg.header.stamp = ns_to_stamp(stamp_ns)
    return msg


def truth_msg(config: ManipulatorConfig, truth: Truth, stamp_ns: int) -> TruthMsg:
    """Return what really happens."""
    channels = {
        kind: [s for s in config.sensors if s.kind == kind] for kind in ("strain_gauge", "accelerometer")
    }
    msg = TruthMsg(
        joint_names=list(config.actuated), gauge_names=[spec.name for spec in channels["strain_gauge"]]
    )
    msg.acceleration_names = [
        f"{s.name}.{channel}" for s in channels["accelerometer"] for channel in s.channels
    ]
    msg.theta, msg.theta_dot, msg.tip = map(floats, (truth.theta, truth.theta_dot, truth.tip))
    msg.strain, msg.relative_acceleration = (
        floats(truth.strain),
        floats(truth.acceleration - truth.rigid_acceleration),
    )
    msg.header.stamp = ns_to_stamp(stamp_ns)
    return msg


def told_strains(specs: Mapping[str, SensorSpec], samples: Sequence[Sample]) -> list[float]:
    """Return what the amplifiers of gauges say of their samples: strain [1], or of a bridge V/V."""
    return [y * specs[sample.sensor].output for sample in samples for y in sample.y.tolist()]


def strain_msg(specs: Mapping[str, SensorSpec], samples: Sequence[Sample], stamp_ns: int) -> Outgoing:
    """Return what gauges delivered at one instant."""
    names = [sample.sensor for sample in samples]
    msg = StrainArray(names=names, strain=floats(told_strains(specs, samples)))
    msg.standard_deviation = floats([s for n in names for s in specs[n].sigma * abs(specs[n].output)])
    msg.header.stamp = ns_to_stamp(stamp_ns)
    sites = {specs[name].site for name in names}
    msg.header.frame_id = sites.pop() if len(sites) == 1 else ""  # gauges all over the arm have none
    return Outgoing("strain", msg)


def sample_msg(spec: SensorSpec, sample: Sample, stamp_ns: int) -> Outgoing:
    """Return a sample of a sensor that has messages of its own: a part of an IMU, a camera."""
    return _CONVERT[sample.kind](spec, sample, stamp_ns)


def _imu(spec: SensorSpec, sample: Sample, stamp_ns: int) -> Outgoing:
    """Return a message of a unit that holds this one of its parts."""
    msg, field = Imu(), INERTIAL_FIELDS[spec.kind]
    msg.header.stamp = ns_to_stamp(stamp_ns)
    msg.header.frame_id = spec.site
    covariance = np.diag([-1.0, -1.0, -1.0])  # REP 145: -1 marks what is not measured
    for part in (*INERTIAL_FIELDS.values(), "orientation"):
        getattr(msg, f"{part}_covariance")[0] = -1.0
    for channel, value, sigma in zip(spec.channels, sample.y, spec.sigma, strict=True):
        setattr(getattr(msg, field), channel, float(value))
        covariance["xyz".index(channel), "xyz".index(channel)] = sigma**2
    getattr(msg, f"{field}_covariance")[:] = covariance.ravel()
    return Outgoing(f"imu/{unit_of(spec)}", msg)


def _camera(spec: SensorSpec, sample: Sample, stamp_ns: int) -> Outgoing:
    msg = PoseWithCovarianceStamped()
    msg.header.stamp = ns_to_stamp(stamp_ns)
    msg.header.frame_id = "base"
    position, orientation = msg.pose.pose.position, msg.pose.pose.orientation
    pose, variance = np.zeros(6), np.full(6, UNSEEN)
    seen = [POSE_CHANNELS.index(channel) for channel in spec.channels]
    pose[seen], variance[seen] = sample.y, spec.sigma**2
    position.x, position.y, position.z = map(float, pose[:3])
    turned = quaternion_from_vector(pose[3:])
    orientation.x, orientation.y, orientation.z, orientation.w = turned
    msg.pose.covariance = np.diag(variance).ravel()
    return Outgoing(camera_topic(spec), msg)


_CONVERT: dict[str, Callable[[SensorSpec, Sample, int], Outgoing]] = {
    "accelerometer": _imu,
    "gyroscope": _imu,
    "camera": _camera,
}
