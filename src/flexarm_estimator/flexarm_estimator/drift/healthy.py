"""How a healthy arm's modes read: as described, or as they did in the first moves that were watched.

A description is rarely right to 3 %, and what it leaves out (modes that nobody serves) moves a reading by the
same at all times. Where the description is not meant to be that good, a change is told against the reading at
the start.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from flexarm_estimator.drift.judgement import Healthy, ModeNow
from flexarm_estimator.drift.settings import DriftConfig


class HealthyModes:
    """Learns once how every mode reads."""

    def __init__(self, config: DriftConfig) -> None:
        """Begin without any."""
        self._config = config
        self._found: dict[str, Healthy] = {}

    def compare(self, modes: Sequence[ModeNow], elapsed: float) -> tuple[ModeNow, ...]:
        """Return the modes with what is healthy for each.

        Args:
            modes: As they run.
            elapsed: Since the watch began [s].
        """
        if elapsed >= self._config.learning > 0.0:
            for mode in modes:
                if self._is_told(mode):
                    self._found.setdefault(
                        mode.name, Healthy(mode.change, mode.change_sigma, mode.zeta, mode.zeta_sigma)
                    )
        return tuple(replace(mode, healthy=self._found.get(mode.name)) for mode in modes)

    def judged(self, modes: Sequence[ModeNow]) -> tuple[ModeNow, ...]:
        """Return those of which it is known how they should read."""
        return tuple(mode for mode in modes if mode.healthy is not None or not self._config.learning)

    def _is_told(self, mode: ModeNow) -> bool:
        """Return whether a change as large as is told would be seen."""
        certain = self._config.sigmas * mode.change_sigma <= self._config.frequency_change
        return mode.is_known and certain
