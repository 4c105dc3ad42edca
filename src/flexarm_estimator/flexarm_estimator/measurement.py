"""A sample of one sensor, as it enters the estimator."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
SAME_INSTANT = 1e-6  # s; stamps closer than this are one instant


class Measurement(NamedTuple):  # not a dataclass: a dozen are made in every period
    """What a sensor said and when.

    Attributes:
        sensor: Name of the sensor, as in the manipulator's YAML.
        t: Instant of the sample, not of its arrival [s].
        y: Value in SI; a camera gives position [m] and rotation vector [rad] of the tip, (m,).
        R: Covariance of the noise, (m, m); None and zeros take the one of the YAML. So does what is no
            covariance or of another shape, and is counted in ``Health.refusals``.
    """

    sensor: str
    t: float
    y: Array
    R: Array | None = None
