"""Change the noise that the estimator counts on."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.interventions.intervention import (
    LEAST_SIGMA,
    MOST,
    Intervention,
    InterventionError,
    require_numbers,
)
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.manipulator.sensor_spec import SensorSpec
from flexarm_model.settings.parameters import ParameterError, validate

SETTINGS = (
    "frequency_error",
    "motion_acceleration",
    "modal_force",
    "acceleration_noise",
    "disturbance_drift",
    "acceleration_error",
    "strain_error",
)


@dataclass(frozen=True)
class SetNoise(Intervention):
    """Another sigma of a sensor, or another setting of the process noise.

    Attributes:
        name: Sensor, or one of ``SETTINGS``.
        value: One sigma of every channel or of all of them, SI; or the setting, one number.
    """

    name: str
    value: tuple[float, ...]

    def check(self, estimator: Estimator) -> None:
        """See Intervention."""
        specs = {spec.name: spec for spec in estimator.specs}
        if self.name in specs:
            require_numbers("value", self.value, (1, len(specs[self.name].channels)), LEAST_SIGMA)
        elif self.name in SETTINGS:
            require_numbers("value", self.value, (1,), -MOST)
            try:
                validate(self._config(estimator.config))
            except ParameterError as error:
                raise InterventionError(f"value: {error}") from None
        else:
            allowed = ", ".join([*specs, *SETTINGS])
            raise InterventionError(f"name: '{self.name}' has no noise to set; allowed: {allowed}")

    def apply(self, estimator: Estimator) -> None:
        """See Intervention."""
        specs = tuple(self._spec(spec) for spec in estimator.specs)
        estimator.retune(specs, self._config(estimator.config))

    def describe(self) -> str:
        """See Intervention."""
        return f"noise of {self.name} is {', '.join(f'{value:g}' for value in self.value)}"

    def _spec(self, spec: SensorSpec) -> SensorSpec:
        if spec.name != self.name:
            return spec
        return replace(spec, sigma=np.broadcast_to(self.value, spec.sigma.shape).copy())

    def _config(self, config: EstimatorConfig) -> EstimatorConfig:
        changes = {item.name: self.value[0] for item in fields(config) if item.name == self.name in SETTINGS}
        return replace(config, **changes)  # type: ignore[arg-type]
