"""What a linear model of one pose leaves out of a sensor's reading, as noise that the filter counts on.

An accelerometer on a fast arm feels centrifugal acceleration, a gauge the curvature of a large deflection.
Neither is white, but a filter that does not know of it refuses the sensor just when the arm moves.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.manipulator.sensor_spec import SensorSpec


def with_model_errors(specs: tuple[SensorSpec, ...], config: EstimatorConfig) -> tuple[SensorSpec, ...]:
    """Return the sensors with their noise and what the model leaves out, root of the sum of squares."""
    errors = {"accelerometer": config.acceleration_error, "strain_gauge": config.strain_error}
    return tuple(replace(spec, sigma=np.hypot(spec.sigma, errors.get(spec.kind, 0.0))) for spec in specs)
