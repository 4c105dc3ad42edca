"""Fixed-lag smoother for recorded data: every state given also what was sampled up to a lag later."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.filter import Belief
from flexarm_estimator.history import Instant
from flexarm_estimator.measurement import SAME_INSTANT, Measurement
from flexarm_estimator.parts import Parts
from flexarm_estimator.smoothing import smooth

Array = NDArray[np.float64]


class Smoothed(NamedTuple):
    """A state given also what came later.

    Attributes:
        t: Instant [s].
        belief: Mean and covariance.
        parts: Of the served model whose coordinates they are in.
    """

    t: float
    belief: Belief
    parts: Parts


class FixedLagSmoother:
    """Runs an estimator over recorded data and looks back."""

    def __init__(self, estimator: Estimator, lag: float) -> None:
        """Look back ``lag`` seconds.

        Raises:
            ValueError: The estimator forgets earlier than that.
        """
        longest = estimator.config.history - estimator.config.max_gap
        if not 0.0 <= lag <= longest + SAME_INSTANT:
            raise ValueError(f"lag: {lag} s is outside [0, {longest:.3g}] s (history - max_gap)")
        self._estimator, self._lag = estimator, lag
        self._told = -math.inf
        self._seen = estimator.past

    def step(self, measurements: Sequence[Measurement], tau: Array, t: float) -> list[Smoothed]:
        """Step the estimator; return the instants that are now older than the lag, oldest first.

        When time jumps, those before the jump are returned first, with what was known then.

        Args:
            measurements: Of any sensor, age and order.
            tau: Torque that acted until ``t``, (n_theta,).
            t: Now [s].
        """
        return self.look_back(self._estimator.step(measurements, tau, t).t)

    def look_back(self, t: float) -> list[Smoothed]:
        """Return the instants that are now older than the lag, oldest first; the estimator has been stepped.

        Args:
            t: Now [s].
        """
        seen, self._seen = self._seen, self._estimator.past
        told = []
        if self._seen[1] is not seen[1]:  # the history began anew
            told = self._tell(seen[1], math.inf)
            self._told = -math.inf
        return told + self._tell(self._seen[1], t - self._lag)

    def finish(self) -> list[Smoothed]:
        """Return the instants that are left, oldest first."""
        return self._tell(self._estimator.past[1], math.inf)

    def _tell(self, instants: Sequence[Instant], until: float) -> list[Smoothed]:
        """Return what has not been told up to a time [s]; the first instant is the fixed start."""
        until += SAME_INSTANT
        due = [i for i in range(1, len(instants)) if self._told < instants[i].t <= until]
        if not due:
            return []
        start = due[0]
        beliefs = smooth(instants[start:])
        told = [
            Smoothed(instants[i].t, beliefs[i - start], instants[i].parts)
            for i in due
            if instants[i].entry is None  # nothing but another model's coordinates
        ]
        self._told = instants[due[-1]].t
        return told
