"""Does a sample that is not fused agree with what the others say?"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filter import Belief, normalised_square
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.parts import Parts

Array = NDArray[np.float64]


class Comparison(NamedTuple):
    """A sample beside its prediction.

    Attributes:
        nu: Innovation, (m,).
        S: Its covariance, of the prediction and of the sample, (m, m).
    """

    nu: Array
    S: Array

    @property
    def nis(self) -> float:
        """``nu' S^-1 nu`` [1]."""
        return normalised_square(self.nu, self.S)


def compare(sample: Measurement, belief: Belief, u: Array, parts: Parts) -> Comparison:
    """Compare a sample with the belief at its stamp; infinitely far off where no pose can be predicted."""
    model, (x, P) = parts.sensors.all()[sample.sensor], belief
    try:
        nu, H = model.linearise(sample.y, x, u)
    except ValueError:
        return Comparison(np.full(sample.y.size, math.inf), model.R)
    return Comparison(nu, H.dot(P).dot(H.T) + model.noise(parts.process.force_cov))
