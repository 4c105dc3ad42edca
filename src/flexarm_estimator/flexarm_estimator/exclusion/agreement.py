"""Does a sample that is not fused agree with what the others say?"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filter import Belief, normalised_square, predict
from flexarm_estimator.history import Instant
from flexarm_estimator.measurement import SAME_INSTANT, Measurement
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


def compare_at_stamp(sample: Measurement, instants: Sequence[Instant]) -> Comparison:
    """Compare a sample with the state at its own stamp, which may be late and between two instants."""
    at = bisect_right(instants, sample.t + SAME_INSTANT, key=lambda instant: instant.t)
    before, after = instants[max(0, at - 1)], instants[min(at, len(instants) - 1)]
    belief, ahead = before.belief, sample.t - before.t
    if ahead <= SAME_INSTANT:
        return compare(sample, belief, before.u, before.parts)
    steps = before.parts.steps
    inputs = steps.inputs(belief, ahead, after.u)  # the torque of the interval that the instant after ends
    transition = steps.transition(belief, ahead, inputs).at(belief.x, inputs)
    return compare(sample, predict(belief, transition, inputs), after.u, before.parts)
