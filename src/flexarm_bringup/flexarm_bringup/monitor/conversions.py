"""Messages of the rig as rows of the monitor's picture."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from flexarm_interfaces.msg import GuardStatus, ModalState, SensorHealth

from flexarm_bringup.monitor.picture import (
    UNKNOWN,
    AxisRow,
    ControllerRow,
    GuardRow,
    ModeRow,
    SensorRow,
    TipRow,
)
from flexarm_controller.conversions import mode_name
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.settings.units import is_sliding

_GUARD = {GuardStatus.STOPPED: "stopped", GuardStatus.ARMED: "armed", GuardStatus.BRAKING: "braking"}
_ESTIMATE = {
    ModalState.OK: "ok",
    ModalState.DEGRADED: "degraded",
    ModalState.LOST: "lost",
    ModalState.STARTING: "starting",
}
_SENSOR = {
    SensorHealth.OK: "ok",
    SensorHealth.STALE: "stale",
    SensorHealth.REJECTED: "rejected",
    SensorHealth.OFF: "off",
    SensorHealth.FAULTY: "faulty",
}
_TIP = ("tip.tx", "tip.ty", "tip.tz")


def guard_from_msg(msg: Any, said: float) -> GuardRow:
    """Return what the guard says; ``said`` is how long ago [s]."""
    mode = _GUARD.get(msg.mode, f"mode {msg.mode}")
    return GuardRow(
        mode,
        msg.reason,
        msg.command_age,
        msg.passed,
        msg.limited,
        msg.refused,
        msg.late_ticks,
        msg.ticks_without_command,
        said,
    )


def controller_from_msg(msg: Any) -> ControllerRow:
    """Return what the controller says."""
    name, active = mode_name(msg.mode), tuple(msg.limits_active)
    return ControllerRow(name, msg.reason, msg.solve_time, msg.missed_cycles, msg.overruns, active)


def estimate_from_msg(msg: Any) -> tuple[str, str]:
    """Return status and reason of an estimate."""
    return _ESTIMATE.get(msg.status, f"status {msg.status}"), msg.reason


def sensors_from_msg(msg: Any) -> tuple[SensorRow, ...]:
    """Return the sensors as the estimator sees them."""
    return tuple(
        SensorRow(s.name, _SENSOR.get(s.status, "?"), s.reason, s.age, s.normalised_innovation, s.rejected)
        for s in msg.sensors
    )


def modes_of(model: ReducedModel, state: Any | None, largest: Mapping[str, float]) -> tuple[ModeRow, ...]:
    """Return the modes of a model with their amplitudes, as what they move the tip by.

    Args:
        model: Served.
        state: ModalState; None where nobody has told one. Amplitudes of another model say nothing.
        largest: Amplitudes seen so far [m], by mode.
    """
    rows = [i for i, name in enumerate(model.outputs.names) if name in _TIP]
    reach = np.linalg.norm(model.outputs.C_pos[rows][:, model.n_theta :], axis=0)  # (n_eta,)
    fits = state is not None and state.model_id == model.model_id and len(state.eta) == model.n_eta
    eta = np.array(state.eta if fits and state is not None else [UNKNOWN] * model.n_eta)
    sigma = _sigma(state, model.n_theta, model.n_eta) if fits else np.full(model.n_eta, UNKNOWN)
    names = enumerate(model.eta_names)
    f_hz = model.omega / (2 * np.pi)
    return tuple(
        ModeRow(
            name,
            float(f_hz[i]),
            float(model.zeta[i]),
            float(eta[i] * reach[i]),
            float(sigma[i] * reach[i]),
            largest.get(name, 0.0),
        )
        for i, name in names
    )


def axes_of(
    model: ReducedModel, state: Any | None, applied: Any | None, config: ManipulatorConfig | None, errors: Any
) -> tuple[AxisRow, ...]:
    """Return the actuated axes.

    Args:
        model: Served.
        state: ModalState, for the positions.
        applied: JointState of the guard's torque.
        config: Description, for the limits.
        errors: Reference minus estimate, in the order of the axes; may be empty.
    """
    theta = dict(zip(state.joint_names, state.theta, strict=False)) if state is not None else {}
    effort = dict(zip(applied.name, applied.effort, strict=False)) if applied is not None else {}
    error = dict(zip(model.theta_names, errors, strict=False))
    limits = {name: axis.effort for name, axis in config.actuated.items()} if config is not None else {}
    return tuple(
        AxisRow(
            name,
            theta.get(name, UNKNOWN),
            error.get(name, UNKNOWN),
            effort.get(name, UNKNOWN),
            limits.get(name, math.inf),
            is_sliding(name),
        )
        for name in model.theta_names
    )


def tip_of(odometry: Any, pair: tuple[Any, Any] | None, to_goal: float) -> TipRow:
    """Return the tip.

    Args:
        odometry: Newest estimate.
        pair: Estimate and truth of one instant; None on hardware.
        to_goal: Distance from the goal of a motion [m].
    """
    variance = np.array(odometry.pose.covariance).reshape(6, 6).diagonal()[:3]
    sigma = np.sqrt(np.maximum(variance, 0.0))
    error = UNKNOWN
    if pair is not None:
        error = float(np.linalg.norm(_position(pair[0]) - np.array(pair[1].tip[:3])))
    position, three = _position(odometry).tolist(), (3.0 * sigma).tolist()
    return TipRow((position[0], position[1], position[2]), (three[0], three[1], three[2]), error, to_goal)


def _position(odometry: Any) -> Any:
    point = odometry.pose.pose.position
    return np.array([point.x, point.y, point.z])


def _sigma(state: Any, n_theta: int, n_eta: int) -> Any:
    """Return one sigma of eta; x begins with theta, then eta."""
    n = math.isqrt(len(state.covariance))
    if n * n != len(state.covariance) or n < n_theta + n_eta:  # nobody tells it
        return np.full(n_eta, UNKNOWN)
    variance = np.array(state.covariance).reshape(n, n).diagonal()[n_theta : n_theta + n_eta]
    return np.sqrt(np.maximum(variance, 0.0))
