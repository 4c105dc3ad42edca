"""Switch a sensor off or on."""

from __future__ import annotations

from dataclasses import dataclass

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.interventions.intervention import Intervention, InterventionError


@dataclass(frozen=True)
class ToggleSensor(Intervention):
    """Fuse a sensor, or do not.

    Attributes:
        sensor: Its name.
        is_on: Fuse it.
    """

    sensor: str
    is_on: bool

    def check(self, estimator: Estimator) -> None:
        """See Intervention."""
        known = [spec.name for spec in estimator.specs]
        if self.sensor not in known:
            raise InterventionError(f"name: no sensor '{self.sensor}'; allowed: {', '.join(known)}")

    def apply(self, estimator: Estimator) -> None:
        """See Intervention."""
        estimator.health.switch(self.sensor, not self.is_on)

    def describe(self) -> str:
        """See Intervention."""
        return f"{self.sensor} is {'on' if self.is_on else 'off'}"
