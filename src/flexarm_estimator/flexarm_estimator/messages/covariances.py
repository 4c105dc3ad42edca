"""Covariances that messages bring along."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_model.manipulator.sensor_spec import SensorSpec

Array = NDArray[np.float64]
_SAME = 1e-9  # relative; a covariance that repeats the description is not worth carrying


class CovarianceReader:
    """Tells covariances worth carrying from those that repeat the description of a sensor."""

    def __init__(self, spec: SensorSpec) -> None:
        """Know the noise that a sensor is described with."""
        self._known = np.diag(np.square(spec.sigma)).ravel().tolist()
        self._shape = (len(spec.sigma), len(spec.sigma))

    def pick(self, told: list[float]) -> Array | None:
        """Return what a message told row by row, (m, m); None when that is known or says nothing (zeros)."""
        is_known = all(abs(a - b) <= _SAME * b for a, b in zip(told, self._known, strict=True))
        return None if is_known or not any(told) else np.array(told).reshape(self._shape)
