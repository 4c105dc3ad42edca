"""Watches: they look at samples and state from outside and say what they find; the state is not theirs.

A new way of catching a bad sensor is a new watch in ``watches.table``. What follows from a finding is
the estimator's: a sensor at fault is put out of use, and its samples are taken out of the recent past, too.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filter import Belief
from flexarm_estimator.history import Instant
from flexarm_estimator.judging.sample_judge import Verdict
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.parts import Parts
from flexarm_model.manipulator.sensor_spec import SensorSpec

Array = NDArray[np.float64]


class View(NamedTuple):  # not a dataclass: made in every step
    """What a watch may look at after a step.

    Attributes:
        t: Now [s].
        u: [tau; 1] held until now, (n_u + 1,).
        inputs: The same as the filter has seen them, with what it adds in front.
        is_ordinary: All verdicts are that the sample was fused.
        belief: State now.
        samples: Of this step that passed the checks, in order of time; also of sensors at fault.
        verdicts: Of the gate on those that were offered to the filter.
        instants: The recent past, in order of time; the last one is now.
    """

    t: float
    u: Array
    belief: Belief
    samples: Sequence[Measurement]
    verdicts: Sequence[Verdict]
    inputs: Array
    is_ordinary: bool = False
    instants: Sequence[Instant] = ()


@dataclass(frozen=True)
class Finding:
    """Something to be said about a sensor.

    Attributes:
        sensor: Name of the sensor.
        reason: What is wrong, with numbers; empty takes back what this watch said before.
        is_fault: True puts the sensor out of use; False only tells.
        since: Its samples from here on are taken out of the state [s].
    """

    sensor: str
    reason: str
    is_fault: bool = False
    since: float = math.inf


class Watch(ABC):
    """Something that looks at every step."""

    @abstractmethod
    def look(self, view: View) -> Sequence[Finding]:
        """Return what is new since the last look."""

    @abstractmethod
    def restart(self, t: float) -> None:
        """Forget what has been seen; ``t`` [s] is now."""

    def use(self, parts: Parts) -> None:  # noqa: B027, most watches do not care
        """Go on with another model."""

    def retune(self, specs: tuple[SensorSpec, ...]) -> None:  # noqa: B027, most watches do not care
        """Go on with other noise of the same sensors."""

    def values(self) -> dict[str, dict[str, float]]:
        """Return figures for the diagnostics, by sensor and name with unit ("latency [s]")."""
        return {}
