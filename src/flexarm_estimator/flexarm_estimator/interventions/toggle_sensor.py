"""Switch a sensor off or on, or some of its channels."""

from __future__ import annotations

from dataclasses import dataclass, replace

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.interventions.intervention import Intervention, InterventionError
from flexarm_estimator.judging.switched_channels import all_channels, switch


@dataclass(frozen=True)
class ToggleSensor(Intervention):
    """Fuse a sensor, or do not.

    Attributes:
        sensor: Its name.
        is_on: Fuse it.
        channels: Those of its channels that this is about; empty for the sensor as a whole, whatever its
            channels are.
    """

    sensor: str
    is_on: bool
    channels: tuple[str, ...] = ()

    def check(self, estimator: Estimator) -> None:
        """See Intervention."""
        specs = {spec.name: spec for spec in estimator.specs}
        if self.sensor not in specs:
            raise InterventionError(f"name: no sensor '{self.sensor}'; allowed: {', '.join(specs)}")
        try:
            switch(specs[self.sensor], self.channels, self.is_on)
        except ValueError as error:
            raise InterventionError(f"channels: {error}") from None

    def apply(self, estimator: Estimator) -> None:
        """See Intervention; where channels change, samples from before are ignored, doubts forgotten."""
        if not self.channels:
            estimator.health.switch(self.sensor, not self.is_on)
            estimator.config = replace(estimator.config)  # it has come to another filter
            return
        old = {spec.name: spec for spec in estimator.specs}
        new = old | {self.sensor: switch(old[self.sensor], self.channels, self.is_on)}
        estimator.retune(tuple(new.values()), replace(estimator.config))
        spec = new[self.sensor]
        out = (channel for channel in all_channels(spec) if channel not in spec.channels)
        estimator.health.leave_out(self.sensor, out)

    def describe(self) -> str:
        """See Intervention."""
        what = f"{self.sensor}: {', '.join(self.channels)}" if self.channels else self.sensor
        return f"{what} is {'on' if self.is_on else 'off'}"
