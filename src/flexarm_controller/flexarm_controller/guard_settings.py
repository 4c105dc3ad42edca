"""The settings of guard and guard node; the limits that follow from the former: ``guarding.derive``."""

import math
from dataclasses import dataclass

from flexarm_controller.guarding.derive import SILENT, gauges_of, guard_limits, hold_of
from flexarm_controller.guarding.settings import GuardSettings
from flexarm_model.settings.arm_settings import LoopSettings
from flexarm_model.settings.parameters import parameter

__all__ = ["GuardNodeSettings", "GuardSettings", "gauges_of", "guard_limits", "hold_of"]


@dataclass(frozen=True)
class GuardNodeSettings(LoopSettings):
    """Settings of the guard node beside those of the guard."""

    start: tuple[float, ...] = parameter((), "Axes at the start; empty: home.", "rad or m")
    patience: float = parameter(
        0.8, "Share of a period after which a state is answered without a command for it.", "1", 0.1, 0.95
    )
    answer_time: float = parameter(
        0.0007, "Least part of a period that is left for such an answer, up to half of it.", "s", 0.0, 0.1
    )
    drive_silence: float = parameter(
        0.035, "Silence of the drives that stops the arm; at least three periods.", "s", 0.005, 1.0
    )

    def longest_silence(self, period: float) -> float:
        """Return the silence of the drives that stops an arm of so long a period [s]; never in lockstep."""
        return math.inf if self.lockstep else max(self.drive_silence, SILENT * period)
