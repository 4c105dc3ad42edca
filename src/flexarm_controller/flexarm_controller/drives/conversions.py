"""What goes over DDS between controller, guard and drives, to and from the core's types."""

from __future__ import annotations

from collections.abc import Sequence

from flexarm_interfaces.msg import GuardStatus, JointCommand
from sensor_msgs.msg import JointState

from flexarm_controller.drives.attachment import Sealed
from flexarm_controller.drives.seal import Mark, Seal
from flexarm_controller.guard import ARMED, BRAKING, STOPPED, Guard, GuardCommand, GuardState
from flexarm_model.conversions import floats, ns_to_stamp, stamp_to_ns

_MODES = {STOPPED: GuardStatus.STOPPED, ARMED: GuardStatus.ARMED, BRAKING: GuardStatus.BRAKING}


def command_from_msg(msg: JointCommand, epoch_ns: int, period_ns: int) -> GuardCommand:
    """Return a command as the guard takes it; it judges the content itself."""
    stamp_ns = stamp_to_ns(msg.header.stamp)
    acts_ns = stamp_to_ns(msg.acts_at) or stamp_ns + period_ns
    t, acts_at = (stamp_ns - epoch_ns) * 1e-9, (acts_ns - epoch_ns) * 1e-9
    return GuardCommand(t, msg.sequence, msg.session_token, tuple(msg.effort), msg.model_id, acts_at)


def drive_state_msg(
    names: Sequence[str], state: GuardState, effort: Sequence[float], stamp_ns: int
) -> JointState:
    """Return what the drives measure for themselves, and the torque that acted until the stamp."""
    msg = JointState(name=list(names), position=floats(state.position), velocity=floats(state.velocity))
    msg.effort = floats(effort)
    msg.header.stamp = ns_to_stamp(stamp_ns)
    return msg


def drive_state_from_msg(msg: JointState, names: Sequence[str]) -> GuardState:
    """Return what the drives measure, in the order of ``names``; nothing where they leave an axis out."""
    at = {name: i for i, name in enumerate(msg.name)}
    places = [at.get(name, len(msg.name)) for name in names]
    velocity, position = (
        tuple(values[i] for i in places) if max(places, default=0) < len(values) else ()
        for values in (msg.velocity, msg.position)
    )
    return GuardState(velocity, position)


def effort_msg(
    names: Sequence[str], effort: Sequence[float], stamp_ns: int, seal: Seal, mark: Mark
) -> JointState:
    """Return torques that are to act from a stamp [ns] on, sealed."""
    msg = JointState(name=list(names), effort=floats(effort))
    msg.header.stamp = ns_to_stamp(stamp_ns)
    msg.header.frame_id = seal.write(mark, stamp_ns, effort)
    return msg


def sealed_from_msg(msg: JointState) -> Sealed:
    """Return sealed torques as they arrived."""
    return Sealed(stamp_to_ns(msg.header.stamp), msg.effort, msg.header.frame_id)


def guard_status_msg(guard: Guard, stamp_ns: int, late_ticks: int = 0) -> GuardStatus:
    """Return what the guard does, and why, and how many periods it answered late."""
    msg = GuardStatus(mode=_MODES[guard.mode], reason=guard.reason, session_token=guard.token)
    msg.passed, msg.limited, msg.refused = guard.passed, guard.limited, guard.refused
    msg.ticks, msg.ticks_without_command, msg.command_age = (
        guard.ticks,
        guard.ticks_without_command,
        guard.age,
    )
    msg.late_ticks = late_ticks
    msg.header.stamp = ns_to_stamp(stamp_ns)
    return msg
