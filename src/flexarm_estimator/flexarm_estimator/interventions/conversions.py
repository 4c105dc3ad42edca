"""Interventions as ROS messages and back, and made of the requests of the services."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from typing import Any

from flexarm_interfaces.msg import Intervention as InterventionMsg
from flexarm_interfaces.msg import KnownState

from flexarm_estimator.interventions.intervention import Intervention, InterventionError
from flexarm_estimator.interventions.reset import Reset
from flexarm_estimator.interventions.set_noise import SetNoise
from flexarm_estimator.interventions.set_state import SetState
from flexarm_estimator.interventions.toggle_sensor import ToggleSensor
from flexarm_model.conversions import floats, ns_to_stamp

_KINDS: dict[type[Intervention], int] = {
    Reset: InterventionMsg.RESET,
    SetState: InterventionMsg.SET_STATE,
    ToggleSensor: InterventionMsg.TOGGLE_SENSOR,
    SetNoise: InterventionMsg.SET_NOISE,
}


def intervention_to_msg(intervention: Intervention, stamp_ns: int) -> InterventionMsg:
    """Return the message of an intervention that follows the step at ``stamp_ns``."""
    msg = InterventionMsg(kind=_KINDS[type(intervention)])
    msg.header.stamp = ns_to_stamp(stamp_ns)
    if isinstance(intervention, ToggleSensor):
        msg.name, msg.is_on = intervention.sensor, intervention.is_on
        msg.channels = list(intervention.channels)
    elif isinstance(intervention, SetNoise):
        msg.name, msg.value = intervention.name, floats(intervention.value)
    elif isinstance(intervention, SetState):
        msg.state = known_state_to_msg(intervention)
    return msg


def intervention_from_msg(msg: Any) -> Intervention:
    """Return the intervention of a message.

    Raises:
        InterventionError: Its kind is unknown.
    """
    kinds = {kind: made for made, kind in _KINDS.items()}
    if msg.kind not in kinds:
        allowed = ", ".join(f"{kind} ({made.__name__})" for kind, made in kinds.items())
        raise InterventionError(f"kind: {msg.kind}; allowed: {allowed}")
    return _READ[kinds[msg.kind]](msg)


def known_state_to_msg(state: SetState) -> KnownState:
    """Return the message of a state."""
    msg = KnownState(model_id=state.model_id, joint_names=list(state.joint_names))
    for item in fields(state):
        if item.name not in ("model_id", "joint_names"):
            setattr(msg, item.name, floats(getattr(state, item.name)))
    return msg


def known_state_from_msg(msg: Any) -> SetState:
    """Return the state of a message."""
    names = [item.name for item in fields(SetState) if item.name not in ("model_id", "joint_names")]
    numbers = {name: tuple(float(value) for value in getattr(msg, name)) for name in names}
    return SetState(**numbers, joint_names=tuple(msg.joint_names), model_id=msg.model_id)


_READ: dict[type[Intervention], Callable[[Any], Intervention]] = {
    Reset: lambda msg: Reset(),
    SetState: lambda msg: known_state_from_msg(msg.state),
    ToggleSensor: lambda msg: ToggleSensor(
        msg.name,
        bool(msg.is_on),
        tuple(getattr(msg, "channels", ())),  # bags of before have none
    ),
    SetNoise: lambda msg: SetNoise(msg.name, tuple(float(value) for value in msg.value)),
}
