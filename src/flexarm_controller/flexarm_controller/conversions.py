"""States, references and commands between the core's types and ROS messages."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields

import numpy as np
from builtin_interfaces.msg import Duration
from flexarm_interfaces.msg import ControllerDebug, ControllerStatus, FeedbackGains, JointCommand, ModalState
from geometry_msgs.msg import Point
from numpy.typing import NDArray
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from flexarm_controller.command import ControlCommand
from flexarm_controller.debug import Expectation
from flexarm_controller.local_law import LocalLaw
from flexarm_controller.reference import Reference
from flexarm_controller.state import ArmState
from flexarm_model.conversions import (
    NS_PER_S,
    floats,
    ns_to_stamp,
    stamp_to_ns,
)
from flexarm_model.motion.conversions import TrajectoryMessageError, trajectory_from_msg
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]

_USABLE = (ModalState.OK, ModalState.DEGRADED)
_MODES = {
    "inactive": ControllerStatus.INACTIVE,
    "mpc": ControllerStatus.MPC,
    "lqr": ControllerStatus.LQR,
    "pd": ControllerStatus.PD,
    "nmpc": ControllerStatus.NONLINEAR,
    "shifted_plan": ControllerStatus.SHIFTED_PLAN,
    "damping": ControllerStatus.DAMPING,
    "hold": ControllerStatus.HOLD,
}
_NAMES = {value: name for name, value in _MODES.items()}


class ReferenceMessageError(ValueError):
    """A trajectory cannot be followed; the text says why."""


def state_from_msg(msg: ModalState, model: ReducedModel, epoch_ns: int) -> ArmState:
    """Return the state; one that does not fit the model comes back as not usable, with the reason."""
    t = (stamp_to_ns(msg.header.stamp) - epoch_ns) * 1e-9
    n, m, names, misfit = model.n_theta, model.n_eta, tuple(msg.joint_names), ""
    sizes = [len(msg.theta), len(msg.theta_dot), len(msg.disturbance), len(msg.eta), len(msg.eta_dot)]
    if names and names != model.theta_names:  # others, or in another order
        misfit = f"state is of {', '.join(names[: n + 1])}, not of {', '.join(model.theta_names)}"
    elif sizes != [n, n, n, m, m] or max(len(msg.sag), len(msg.stiffness)) > m:
        misfit = f"state has sizes {sizes}"
    if misfit:
        zero, none = np.zeros(n), np.zeros(m)
        return ArmState(t, msg.model_id, zero, none, zero, none, zero, False, misfit)
    theta, theta_dot, d, eta, eta_dot, sag, stiffness = (
        np.array(part, dtype=float)
        for part in (msg.theta, msg.theta_dot, msg.disturbance, msg.eta, msg.eta_dot, msg.sag, msg.stiffness)
    )
    usable, sigma = msg.status in _USABLE, _sigma(msg.covariance, 2 * (n + m))
    return ArmState(
        t, msg.model_id, theta, eta, theta_dot, eta_dot, d, usable, msg.reason, sigma, sag, stiffness, msg.age
    )


def reference_from_msg(msg: JointTrajectory, names: tuple[str, ...], epoch_ns: int) -> Reference:
    """Return the reference of a trajectory; what it leaves out: see ``trajectory_from_msg``.

    Raises:
        ReferenceMessageError: Names, lengths, times or numbers do not fit.
    """
    try:
        trajectory = trajectory_from_msg(msg, names, epoch_ns)
    except TrajectoryMessageError as error:
        raise ReferenceMessageError(str(error)) from None
    return Reference(*(getattr(trajectory, field.name) for field in fields(trajectory)))


def reference_to_msg(reference: Reference, names: tuple[str, ...], epoch_ns: int) -> JointTrajectory:
    """Return the trajectory message of a reference; accelerations that jump are left to its cubics."""
    msg = JointTrajectory(joint_names=list(names))
    start_ns = round(reference.t[0] * NS_PER_S)
    msg.header.stamp = ns_to_stamp(start_ns + epoch_ns)
    for t, theta, theta_dot, theta_ddot in zip(
        reference.t, reference.theta, reference.theta_dot, reference.theta_ddot, strict=True
    ):
        sec, nanosec = divmod(round(t * NS_PER_S) - start_ns, NS_PER_S)
        point = JointTrajectoryPoint(time_from_start=Duration(sec=sec, nanosec=nanosec))
        point.positions, point.velocities = floats(theta), floats(theta_dot)
        if reference.theta_ddot_before is None:
            point.accelerations = floats(theta_ddot)
        msg.points.append(point)
    return msg


def mode_name(mode: int) -> str:
    """Return a mode of ControllerStatus in words."""
    return _NAMES.get(mode, f"mode {mode}")


def command_to_msg(
    command: ControlCommand, names: tuple[str, ...], sequence: int, token: int, stamp_ns: int
) -> JointCommand:
    """Return the command message, stamped like the state used [ns]."""
    msg = JointCommand(sequence=sequence, session_token=token, model_id=command.model_id, names=list(names))
    msg.effort = floats(command.tau)
    msg.header.stamp, msg.acts_at = ns_to_stamp(stamp_ns), ns_to_stamp(acts_ns(command, stamp_ns))
    return msg


def acts_ns(command: ControlCommand, stamp_ns: int) -> int:
    """Return the begin of the period that a command is meant for [ns], from the stamp of its state [ns]."""
    return stamp_ns + round((command.acts_at - command.t) * NS_PER_S)


def status_to_msg(command: ControlCommand, missed: int, overruns: int, stamp_ns: int) -> ControllerStatus:
    """Return what the controller did in this cycle, stamped like the state used [ns]."""
    msg = ControllerStatus(mode=_MODES[command.mode], reason=command.reason, model_id=command.model_id)
    msg.solver_status, msg.iterations = command.solver_status, command.iterations
    msg.residual, msg.solve_time = float(command.residual), float(command.solve_time)
    msg.missed_cycles, msg.overruns = missed, overruns
    msg.limits_active, msg.tracking_error = list(command.limits_active), floats(command.tracking_error)
    msg.header.stamp = ns_to_stamp(stamp_ns)
    return msg


def _sigma(covariance: Sequence[float], n_x: int) -> Array:
    """Return the standard deviations of the first ``n_x`` coordinates; none where nobody tells them."""
    size = math.isqrt(len(covariance))
    if not size:
        return np.zeros(0)
    if size * size != len(covariance) or size < n_x:
        return np.full(n_x, np.inf)
    variances = np.array(covariance[:: size + 1], dtype=float)[:n_x]
    return np.sqrt(np.where(variances >= 0.0, variances, np.inf))


def debug_to_msg(
    command: ControlCommand, expected: Expectation, period: float, backend: str, mode_names: tuple[str, ...]
) -> ControllerDebug:
    """Return what the plan of a command leads to, and what it took; without a stamp."""
    msg = ControllerDebug(period=period, mode_names=list(mode_names), iterations=command.iterations)
    msg.header.frame_id = "base"
    msg.tip = [Point(x=x, y=y, z=z) for x, y, z in expected.tip.tolist()]
    msg.modal_energy, msg.mode_energy = floats(expected.energy), floats(expected.mode_energy)
    msg.update_time, msg.solve_time, msg.check_time = map(float, command.split)
    msg.backend, msg.solver_status = backend if command.mode == "mpc" else "", command.solver_status
    msg.limits_active = list(command.limits_active)
    return msg


def gains_to_msg(
    command: ControlCommand, law: LocalLaw, names: tuple[str, ...], mode_names: tuple[str, ...], stamp_ns: int
) -> FeedbackGains:
    """Return the law about the state in which a command begins to act, stamped like the state used [ns]."""
    msg = FeedbackGains(model_id=command.model_id, joint_names=list(names), names=list(mode_names))
    msg.header.stamp, msg.acts_at = ns_to_stamp(stamp_ns), ns_to_stamp(acts_ns(command, stamp_ns))
    msg.x, msg.x_next = floats(law.x), floats(law.x_next)
    msg.effort, msg.gain = floats(command.tau), floats(law.gain)
    msg.limits_active = list(command.limits_active)
    return msg


def predicted_to_msg(
    command: ControlCommand, states: Array, names: tuple[str, ...], period: float, stamp_ns: int
) -> JointTrajectory:
    """Return the motion of the axes that a command's plan leads to, from when it begins to act.

    Args:
        command: With its plan, (k, n_theta).
        states: At the begin and after each period of the plan, (k + 1, 2 n).
        names: Actuated axes.
        period: Between two of them [s].
        stamp_ns: Of the state that the command answers [ns].
    """
    msg = JointTrajectory(joint_names=list(names))
    msg.header.stamp, msg.header.frame_id = ns_to_stamp(acts_ns(command, stamp_ns)), "base"
    n, m = states.shape[1] // 2, len(names)
    for k, x in enumerate(states):
        sec, nanosec = divmod(round(k * period * NS_PER_S), NS_PER_S)
        point = JointTrajectoryPoint(time_from_start=Duration(sec=sec, nanosec=nanosec))
        point.positions, point.velocities = floats(x[:m]), floats(x[n : n + m])
        point.effort = floats(command.plan[min(k, len(command.plan) - 1)])
        msg.points.append(point)
    return msg


def notice_msg(reason: str, stamp_ns: int, missed: int = 0, overruns: int = 0) -> ControllerStatus:
    """Return a status that tells of something, a reference taken or a model refused, and what is counted."""
    msg = ControllerStatus(mode=ControllerStatus.INACTIVE, reason=reason)
    msg.missed_cycles, msg.overruns = missed, overruns
    msg.header.stamp = ns_to_stamp(stamp_ns)
    return msg
