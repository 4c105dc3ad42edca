"""Sensor messages as samples, without touching what is inside a sample: that is the estimator's.

Messages are read by their fields, so this file needs no ROS. Real drivers leave arrays empty, send
covariances of zeros and frames of their own; whatever cannot be used comes back as a ``Refusal``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.measurement import Measurement
from flexarm_estimator.messages.camera_messages import CameraReader
from flexarm_estimator.messages.covariances import CovarianceReader
from flexarm_estimator.messages.readings import Reading, Refusal
from flexarm_model.manipulator.cameras import camera_topic, cameras
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.manipulator.imu import imus
from flexarm_model.manipulator.sensor_spec import SensorSpec

Array = NDArray[np.float64]
INERTIAL_FIELDS = {"accelerometer": "linear_acceleration", "gyroscope": "angular_velocity"}  # of an Imu
_OVERLOAD = 10.0  # of an axis' largest torque; no motor gives that
_MOST_TORQUE = 1e6  # N m or N; of axes without a limit


class SensorReader:
    """Reads the messages of one manipulator's sensors."""

    def __init__(self, config: ManipulatorConfig) -> None:
        """Sort the sensors by the topic that carries them."""
        by_kind = {kind: {s.name: s for s in config.sensors if s.kind == kind} for kind in _KINDS}
        self._encoders = by_kind["encoder"]
        self._gauges = by_kind["strain_gauge"]
        self._covariances = {spec.name: CovarianceReader(spec) for spec in self._gauges.values()}
        self._axes = tuple(config.actuated)
        efforts = np.array([axis.effort for axis in config.actuated.values()])
        self._most_torque = np.where(np.isfinite(efforts), _OVERLOAD * efforts, _MOST_TORQUE).tolist()
        known_axes = {f"{joint.name}.{axis.name}" for joint in config.joints for axis in joint.axes}
        self._known_axes = known_axes
        self._read: dict[str, Callable[[Any, float], Reading]] = {"joint_states": self._read_joints}
        if self._gauges:
            self._read["strain"] = self._read_strain
        for camera in cameras(config.sensors).values():
            self._read[camera_topic(camera)] = CameraReader(camera).read
        for unit, specs in imus(config.sensors).items():
            self._read[f"imu/{unit}"] = _imu_reader(unit, specs)

    @property
    def topics(self) -> tuple[str, ...]:
        """Relative topics that carry this manipulator's sensors."""
        return tuple(self._read)

    def read(self, topic: str, msg: Any, t: float) -> Reading:
        """Return the samples of a message.

        Args:
            topic: Relative topic, one of ``topics``; another gives a refusal.
            msg: The message.
            t: Its stamp in seconds of rig time.
        """
        reader = self._read.get(topic)
        if reader is None:
            return Reading([], [Refusal(topic, f"no sensor there; known: {', '.join(self._read)}")])
        return reader(msg, t)

    def read_torque(self, topic: str, msg: Any) -> tuple[Array | None, list[Refusal]]:
        """Return the torque of the actuated axes in a JointState, (n_theta,), or None and why."""
        if len(msg.effort) != len(msg.name):
            return None, [Refusal(topic, f"{len(msg.effort)} efforts for {len(msg.name)} names")]
        by_name = dict(zip(msg.name, msg.effort, strict=True))
        missing = [name for name in self._axes if name not in by_name]
        if missing:
            return None, [Refusal(topic, f"no axis '{missing[0]}' among {', '.join(msg.name) or 'no names'}")]
        torque = [by_name[name] for name in self._axes]  # few, and soonest judged one by one
        if not all(map(math.isfinite, torque)):
            return None, [Refusal(topic, "torque is not finite")]
        if any(abs(tau) > most for tau, most in zip(torque, self._most_torque, strict=True)):
            return None, [Refusal(topic, f"torque is more than {_OVERLOAD:g} times the axis' limit")]
        return np.array(torque), []

    def _read_joints(self, msg: Any, t: float) -> Reading:
        reading, names = Reading(), list(msg.name)
        strangers = [name for name in names if name not in self._known_axes]
        if strangers:
            reading.refusals.append(Refusal("joint_states", _unknown(strangers)))
        for spec in self._encoders.values():
            if len(msg.position) != len(names):
                reason = f"{len(msg.position)} positions for {len(names)} names"
                reading.refusals.append(Refusal(spec.name, reason))
            elif spec.site not in names:
                reading.refusals.append(Refusal(spec.name, f"no joint '{spec.site}' in joint_states"))
            else:
                y = np.array([msg.position[names.index(spec.site)]])
                reading.samples.append(Measurement(spec.name, t, y))
        return reading

    def _read_strain(self, msg: Any, t: float) -> Reading:
        reading = Reading()
        sizes_differ = len(msg.names) != len(msg.strain)
        if sizes_differ or len(msg.standard_deviation) not in (0, len(msg.names)):
            sizes = (len(msg.names), len(msg.strain), len(msg.standard_deviation))
            reason = "{} names, {} strains, {} sigmas".format(*sizes)
            return Reading([], [Refusal(name, reason) for name in self._gauges])
        for i, name in enumerate(msg.names):
            spec = self._gauges.get(name)
            if spec is None:
                reading.refusals.append(Refusal("strain", f"unknown gauge '{name}'"))
                continue
            sigma = float(msg.standard_deviation[i]) if len(msg.standard_deviation) else 0.0
            sigma, strain = sigma / spec.output, float(msg.strain[i]) / spec.output
            R = self._covariances[name].pick([sigma * sigma])  # ** and square overflow
            reading.samples.append(Measurement(name, t, np.array([strain]), R))
        return reading


def _unknown(joints: Sequence[str]) -> str:
    """Return the reason that names joints, in the same order whatever that of the message."""
    names = sorted(set(joints))
    told = "', '".join(names)
    return f"unknown joints '{told}'" if len(names) > 1 else f"unknown joint '{told}'"


def _imu_reader(unit: str, specs: Sequence[SensorSpec]) -> Callable[[Any, float], Reading]:
    parts = [_InertialPart(spec) for spec in specs]

    def read(msg: Any, t: float) -> Reading:
        """Read a message of the unit; one that carries some of its parts only is in order."""
        frame = msg.header.frame_id
        strangers = [part.name for part in parts if part.frame != frame]
        if strangers:
            reason = f"frame '{frame}' is not '{parts[0].frame}'"
            return Reading([], [Refusal(name, reason) for name in strangers])
        samples = [sample for part in parts if (sample := part.read(msg, t)) is not None]
        if samples:
            return Reading(samples)
        return Reading([], [Refusal(part.name, part.absence) for part in parts])

    return read


class _InertialPart:
    """Reads what one sensor of a unit says in its messages."""

    def __init__(self, spec: SensorSpec) -> None:
        self.name, self.frame = spec.name, spec.site
        self._field = INERTIAL_FIELDS[spec.kind]
        self._channels, self._covariances = spec.channels, CovarianceReader(spec)
        self._rows = ["xyz".index(channel) for channel in spec.channels]
        self.absence = f"driver says that {self._field.replace('_', ' ')} is not measured"

    def read(self, msg: Any, t: float) -> Measurement | None:
        """Return the sample; None where the driver says that it is not measured (REP 145)."""
        told = np.asarray(getattr(msg, f"{self._field}_covariance"), dtype=np.float64).tolist()
        known = [told[4 * i] for i in self._rows]
        if min(known) < 0.0 or (told[0] < 0.0 and not any(known)):
            return None
        vector = getattr(msg, self._field)
        y = np.array([getattr(vector, channel) for channel in self._channels])
        R = self._covariances.pick([told[3 * i + j] for i in self._rows for j in self._rows])
        return Measurement(self.name, t, y, R)


_KINDS = ("encoder", "strain_gauge")  # IMUs and cameras have topics of their own
