"""The settings of guard and guard node; the limits that follow from the former: ``guarding.derive``."""

from dataclasses import dataclass

from flexarm_controller.guarding.derive import GuardSettings, guard_limits
from flexarm_model.parameters import parameter

__all__ = ["GuardNodeSettings", "GuardSettings", "guard_limits"]


@dataclass(frozen=True)
class GuardNodeSettings:
    """Settings of the guard node beside those of the guard."""

    manipulator: str = parameter("single_link", "Name of a manipulator that comes along, or a YAML file.")
    preset: str = parameter("geared", "Preset of that file; empty for none.")
    start: tuple[float, ...] = parameter((), "Axes at the start; empty: home.", "rad or m")
    lockstep: bool = parameter(False, "Wait for the ticks of the simulated rig.")
    patience: float = parameter(
        0.8, "Share of a period after which a state is answered without a command for it.", "1", 0.1, 0.95
    )
    drive_silence: float = parameter(0.035, "Silence of the drives that stops the arm.", "s", 0.005, 1.0)
    realtime_priority: int = parameter(
        0,
        "SCHED_FIFO priority while running, where the user may; 0 leaves it ordinary.",
        minimum=0,
        maximum=90,
    )
