"""Parameters that nodes have in common: the arm they work with, and how they keep time."""

from __future__ import annotations

from dataclasses import dataclass

from flexarm_model.settings.parameters import parameter


@dataclass(frozen=True)
class ArmSettings:
    """Parameters of every node that works with an arm."""

    manipulator: str = parameter("single_link", "Name of a manipulator that comes along, or a YAML file.")
    preset: str = parameter("geared", "Preset of that file; empty for none.")


@dataclass(frozen=True)
class LoopSettings(ArmSettings):
    """Parameters of every node in the loop that moves the arm."""

    lockstep: bool = parameter(False, "Wait for the ticks of the simulated rig.")
    realtime_priority: int = parameter(
        0,
        "SCHED_RR priority while running, where the user may; 0 leaves it ordinary.",
        minimum=0,
        maximum=90,
    )
    cores: tuple[int, ...] = parameter((), "Cores to run on; empty: any.", minimum=0)
