"""Settings of the drift watch."""

from __future__ import annotations

from dataclasses import dataclass

from flexarm_model.settings.parameters import parameter


@dataclass(frozen=True)
class DriftConfig:
    """How long is averaged, and what counts as drift."""

    memory: float = parameter(
        5.0, "Time of motion after which what a move told counts 1/e", "s", minimum=0.5, maximum=600.0
    )
    frequency_change: float = parameter(
        0.03, "Relative change of a frequency that is told", "1", minimum=0.005, maximum=0.5
    )
    damping_change: float = parameter(
        1.0, "Relative change of a damping ratio that is told", "1", minimum=0.1, maximum=100.0
    )
    sigmas: float = parameter(
        5.0, "A change that is told is at least so many of its sigma", "1", minimum=1.0, maximum=20.0
    )
    learning: float = parameter(
        0.0,
        "Time at the start after which readings are kept as those of the healthy arm; 0: it is as described",
        "s",
        minimum=0.0,
        maximum=3600.0,
    )
    patience: float = parameter(1.0, "It is told when it has lasted so long", "s", minimum=0.0, maximum=60.0)
    fastest: float = parameter(
        0.35, "Modes up to this share of the control rate are watched", "1", minimum=0.01, maximum=0.5
    )
    largest_damping: float = parameter(
        0.2, "Modes damped more do not ring: they are left alone", "1", minimum=0.001, maximum=1.0
    )
