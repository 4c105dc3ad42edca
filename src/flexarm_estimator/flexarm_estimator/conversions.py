"""Estimates as ROS messages and back, health as diagnostics.

The tip travels as an Odometry from "base" to "tool"; by its convention the twist is in the axes of the
tool, so it is turned there and back.
"""

from __future__ import annotations

from array import array
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from flexarm_interfaces.msg import ModalState, SensorHealth
from nav_msgs.msg import Odometry
from numpy.typing import NDArray

from flexarm_estimator.estimate import Estimate, SensorReport
from flexarm_estimator.messages.camera_messages import BASE_FRAME
from flexarm_estimator.messages.readings import MISSING_AXIS, STRANGERS
from flexarm_model.conversions import floats, ns_to_stamp
from flexarm_model.numeric.rotation import quaternion, rotation_from_quaternion
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]
TOOL_FRAME = "tool"
STATE_NUMBERS = (
    "theta", "theta_dot", "disturbance", "eta", "eta_dot", "sag", "stiffness", "bias", "covariance",
)  # fmt: skip
_STATUS = {
    "ok": ModalState.OK,
    "degraded": ModalState.DEGRADED,
    "lost": ModalState.LOST,
    "starting": ModalState.STARTING,
}
_SENSOR_STATUS = {
    "ok": SensorHealth.OK,
    "stale": SensorHealth.STALE,
    "rejected": SensorHealth.REJECTED,
    "off": SensorHealth.OFF,
    "faulty": SensorHealth.FAULTY,
}
_LEVEL = {
    "ok": DiagnosticStatus.OK,
    "degraded": DiagnosticStatus.WARN,
    "lost": DiagnosticStatus.ERROR,
    "starting": DiagnosticStatus.WARN,
    "stale": DiagnosticStatus.STALE,
    "rejected": DiagnosticStatus.ERROR,
    "off": DiagnosticStatus.WARN,
    "faulty": DiagnosticStatus.ERROR,
}


@dataclass(frozen=True)
class TipMotion:
    """Pose and velocity of the tip in world axes, as in ``Estimate``.

    Attributes:
        T_world_tip: (4, 4).
        twist: [linear; angular], (6,).
        cov_pose: (6, 6).
        cov_twist: (6, 6).
    """

    T_world_tip: Array
    twist: Array
    cov_pose: Array
    cov_twist: Array


def state_to_msg(estimate: Estimate, model: ReducedModel, stamp_ns: int) -> ModalState:
    """Return the message of the joints, modes and disturbance."""
    msg = ModalState()
    msg.header.stamp = ns_to_stamp(stamp_ns)
    msg.header.frame_id = BASE_FRAME
    msg.model_id, msg.reason, msg.status = estimate.model_id, estimate.reason, _STATUS[estimate.status]
    msg.age = estimate.age
    msg.joint_names, msg.names = list(model.theta_names), list(model.eta_names)
    msg.bias_names = list(estimate.layout.biases)
    for name, numbers in zip(STATE_NUMBERS, state_numbers(estimate), strict=True):
        setattr(msg, name, array("d", numbers))
    msg.sensors = [_health_to_msg(report) for report in estimate.sensors]
    return msg


def state_numbers(estimate: Estimate) -> list[list[float]]:
    """Return what ``STATE_NUMBERS`` of a state are, each row major."""
    x, at = estimate.x, estimate.layout
    parts = (x[at.theta], x[at.theta_dot], x[at.d], x[at.eta], x[at.eta_dot], x[at.s])
    more = (estimate.stiffness, x[at.b], estimate.P[at.told, at.told].ravel())
    return [part.tolist() for part in (*parts, *more)]


def state_from_msg(msg: ModalState) -> tuple[Array, Array, str, tuple[SensorReport, ...]]:
    """Return x (n_x,), P (n_x, n_x), status and sensors of a message.

    Raises:
        ValueError: Its lengths do not fit together.
    """
    x = np.concatenate([msg.theta, msg.eta, msg.theta_dot, msg.eta_dot, msg.disturbance, msg.bias])
    if len(msg.covariance) != x.size**2:
        raise ValueError(f"covariance has {len(msg.covariance)} numbers, {x.size**2} expected")
    status = next(name for name, value in _STATUS.items() if value == msg.status)
    reports = tuple(_health_from_msg(health) for health in msg.sensors)
    return x, np.array(msg.covariance).reshape(x.size, x.size), status, reports


def tip_to_msg(estimate: Estimate, stamp_ns: int) -> Odometry:
    """Return the message of the tip."""
    msg = Odometry(child_frame_id=TOOL_FRAME)
    msg.header.stamp = ns_to_stamp(stamp_ns)
    msg.header.frame_id = BASE_FRAME
    position, orientation = msg.pose.pose.position, msg.pose.pose.orientation
    linear, angular = msg.twist.twist.linear, msg.twist.twist.angular
    xyz, xyzw, cov_pose, twist, cov_twist = tip_numbers(estimate)
    position.x, position.y, position.z = xyz
    orientation.x, orientation.y, orientation.z, orientation.w = xyzw
    linear.x, linear.y, linear.z, angular.x, angular.y, angular.z = twist
    msg.pose.covariance, msg.twist.covariance = np.array(cov_pose), np.array(cov_twist)
    return msg


def tip_numbers(estimate: Estimate) -> tuple[list[float], list[float], list[float], list[float], list[float]]:
    """Return position, orientation (x, y, z, w), their covariance, the tool's twist and its covariance."""
    T = estimate.T_world_tip
    into_tool = _turn(T[:3, :3].T)
    return (
        T[:3, 3].tolist(),
        list(quaternion(T[:3, :3])),
        estimate.cov_tip_pose.ravel().tolist(),
        into_tool.dot(estimate.twist_tip).tolist(),
        into_tool.dot(estimate.cov_tip_twist).dot(into_tool.T).ravel().tolist(),
    )


def tip_from_msg(msg: Odometry) -> TipMotion:
    """Return the tip's motion in world axes."""
    position, q = msg.pose.pose.position, msg.pose.pose.orientation
    T = np.eye(4)
    T[:3, :3] = rotation_from_quaternion((q.x, q.y, q.z, q.w))
    T[:3, 3] = [position.x, position.y, position.z]
    linear, angular = msg.twist.twist.linear, msg.twist.twist.angular
    turn = _turn(T[:3, :3])
    twist = turn @ np.array([linear.x, linear.y, linear.z, angular.x, angular.y, angular.z])
    cov_pose, cov_twist = (np.array(part.covariance).reshape(6, 6) for part in (msg.pose, msg.twist))
    return TipMotion(T, twist, cov_pose, turn @ cov_twist @ turn.T)


def diagnostics_msg(
    estimate: Estimate | None,
    fault: str,
    refusals: Mapping[str, Mapping[str, int]],
    stamp_ns: int,
    figures: Mapping[str, Mapping[str, float]] = MappingProxyType({}),
) -> DiagnosticArray:
    """Return the health of estimator and sensors, and what was refused of their messages.

    Args:
        estimate: The newest one; None before the first.
        fault: Why there is none, or what else is wrong; empty when nothing is.
        refusals: Counts by sensor or topic and reason, the newest reason last.
        stamp_ns: Now [ns].
        figures: What else is known of the sensors, by name with unit.
    """
    msg = DiagnosticArray()
    msg.header.stamp = ns_to_stamp(stamp_ns)
    reports = () if estimate is None else estimate.sensors
    if estimate is None:
        msg.status.append(_status("state", DiagnosticStatus.ERROR, fault or "no samples yet", {}))
    else:
        text = fault or estimate.reason or "ok"
        level = DiagnosticStatus.ERROR if fault else _LEVEL[estimate.status]
        msg.status.append(_status("state", level, text, {"model_id": estimate.model_id}))
    for report in reports:
        msg.status.append(_sensor_status(report, refusals.get(report.name, {}), figures.get(report.name, {})))
    told = {report.name for report in reports}
    for source in (source for source in refusals if source not in told):
        reasons = refusals[source]
        values = {"refused": sum(reasons.values()), **_counts(reasons)}
        level = DiagnosticStatus.WARN if _is_harmless(source, refusals) else DiagnosticStatus.ERROR
        msg.status.append(_status(source, level, list(reasons)[-1], values))
    return msg


def _is_harmless(source: str, refusals: Mapping[str, Mapping[str, int]]) -> bool:
    """Tell whether what was refused does no harm: joints of a gripper, where the arm's axes are told, too."""
    lacks_axis = any(reason.startswith(MISSING_AXIS) for reasons in refusals.values() for reason in reasons)
    are_strangers = all(reason.startswith(STRANGERS) for reason in refusals[source])
    return source.endswith("_timestamp") or (are_strangers and not lacks_axis)


def _sensor_status(
    report: SensorReport, refusals: Mapping[str, int], figures: Mapping[str, float]
) -> DiagnosticStatus:
    values = {
        "accepted": report.accepted,
        "rejected": report.rejected,
        "age [s]": f"{report.age:.3f}",
        "normalised innovation": f"{report.normalised:.2f}",
        **{name: f"{value:.6g}" for name, value in figures.items()},
        **_counts(refusals),
    }
    is_refused = report.status == "stale" and any(reason in report.reason for reason in refusals)
    level = DiagnosticStatus.ERROR if is_refused else _LEVEL[report.status]  # it speaks, but cannot be used
    return _status(report.name, level, report.reason or "ok", values)


def _counts(refusals: Mapping[str, int]) -> dict[str, int]:
    return {f"refused: {reason}": count for reason, count in refusals.items()}


def _status(name: str, level: bytes, text: str, values: Mapping[str, object]) -> DiagnosticStatus:
    pairs = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
    return DiagnosticStatus(
        name=f"estimator: {name}", hardware_id=name, level=level, message=text, values=pairs
    )


def _health_to_msg(report: SensorReport) -> SensorHealth:
    msg = SensorHealth(name=report.name, status=_SENSOR_STATUS[report.status], reason=report.reason)
    msg.age, msg.accepted, msg.rejected = float(report.age), report.accepted, report.rejected
    msg.innovation, msg.normalised_innovation = floats(report.innovation), float(report.normalised)
    return msg


def _health_from_msg(msg: SensorHealth) -> SensorReport:
    status = next(name for name, value in _SENSOR_STATUS.items() if value == msg.status)
    return SensorReport(
        msg.name, status, msg.reason, msg.age, msg.accepted, msg.rejected,  # type: ignore[arg-type]
        np.array(msg.innovation), msg.normalised_innovation,
    )  # fmt: skip


def _turn(R: Array) -> Array:
    """Return the rotation of [linear; angular], (6, 6)."""
    both = np.zeros((6, 6))
    both[:3, :3] = both[3:, 3:] = R
    return both
