"""Settings of motions: how much of the limits they may use, when a goal counts as reached."""

from __future__ import annotations

from dataclasses import dataclass

from flexarm_model.settings.parameters import parameter, validate


@dataclass(frozen=True)
class MotionConfig:
    """Limits of planned motions, what becomes of references beyond them, and when a goal is reached."""

    motion_effort: float = parameter(
        0.8, "Share of the torque limits that a planned motion may need.", "1", minimum=0.01, maximum=1.0
    )
    motion_strain: float = parameter(
        0.8,
        "Share of the gauges' limits that a planned motion, or a reference slowed down for strain, may bend "
        "the arm by.",
        "1",
        0.01,
        1.0,
    )
    motion_velocity: float = parameter(
        1.0, "Share of the velocity limits that a planned motion may reach.", "1", minimum=0.01, maximum=1.0
    )
    motion_ramp: float = parameter(
        0.25, "Least time from zero to full acceleration, in periods of the slowest mode.", "1", 0.0, 10.0
    )
    guard_braking_share: float = parameter(
        0.5, "Guard's braking_share, for motions near an end.", "1", 0.05, 1.0
    )
    motion_lead: float = parameter(
        0.05,
        "Time between taking a planned motion of the tip and leaving what was followed before.",
        "s",
        0.0,
        10.0,
    )
    excess: str = parameter(
        "retime",
        "A reference that needs more torque than there is, or bends a gauge beyond its limit: slow it down, "
        "follow it and tell, refuse it, or stretch it and those beyond a velocity limit in time.",
        choices=("retime", "tell", "refuse", "stretch"),
    )
    excess_slowdown: float = parameter(
        10.0,
        "A reference that must be slowed down to more than this many times its own time is refused.",
        "1",
        1.0,
        1000.0,
    )
    settle_distance: float = parameter(5e-4, "Tip counts as settled so near its goal.", "m", 1e-6, 1.0)
    settle_time: float = parameter(0.1, "It must stay there so long.", "s", 0.0, 10.0)
    settle_patience: float = parameter(
        2.0, "A goal that is not settled so long after the motion's end is given up.", "s", 0.0, 600.0
    )
    motion_status_rate: float = parameter(20.0, "Messages on motion_status per second.", "Hz", 0.1, 1000.0)

    def __post_init__(self) -> None:
        """Check every field.

        Raises:
            ParameterError: A value is outside its range.
        """
        validate(self)
