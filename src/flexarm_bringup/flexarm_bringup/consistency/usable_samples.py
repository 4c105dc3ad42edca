"""Samples of a record as the estimator takes them: what it refuses is left out, and covariances are floored.

It refuses what cannot be (outside the physical range, not finite, said twice), whatever its state. Near the
end of a range a sample is less certain. A covariance that a message brings counts as far as it is believed,
and then the sigma of the description changes nothing.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from flexarm_estimator.judging.checks import SampleChecks, Window
from flexarm_estimator.measurement import Measurement
from flexarm_model.manipulator.sensor_spec import SensorSpec

ALWAYS = Window(-math.inf, math.inf)
MOST = 0.5  # share of a sensor's samples with a covariance of their own, from which on its sigma is of no use


@dataclass(frozen=True)
class UsableSamples:
    """What is left of a record.

    Attributes:
        samples: In order of time.
        refused: How many are left out, by sensor and by reason.
        own: Sensors most of whose samples bring a covariance of their own.
    """

    samples: tuple[Measurement, ...]
    refused: Mapping[str, Mapping[str, int]]
    own: tuple[str, ...]

    def describe(self) -> list[str]:
        """Return one line for every sensor of which samples are left out."""
        return [
            f"left out, as the estimator does, of {sensor}: "
            + ", ".join(f"{count} samples ({reason})" for reason, count in sorted(reasons.items()))
            for sensor, reasons in self.refused.items()
        ]


def usable_samples(samples: Sequence[Measurement], specs: tuple[SensorSpec, ...]) -> UsableSamples:
    """Return the samples that may reach a filter, with the noise that it gives them.

    Args:
        samples: Of sensors of the description, in order of time.
        specs: Of the description.
    """
    checks = SampleChecks(specs)
    used: list[Measurement] = []
    refused: dict[str, Counter[str]] = {}
    told, own = Counter[str](), Counter[str]()
    for sample in samples:
        reason = checks.refuse(sample, ALWAYS)
        if reason:
            refused.setdefault(sample.sensor, Counter())[reason] += 1
            continue
        told[sample.sensor] += 1
        own[sample.sensor] += checks.own_covariance(sample) is not None
        used.append(sample._replace(R=checks.noise(sample)))
    most = tuple(sensor for sensor, count in own.items() if count > MOST * told[sensor])
    return UsableSamples(tuple(used), refused, most)


def own_words(sensors: Sequence[str]) -> list[str]:
    """Return what is said of sensors that bring a covariance of their own."""
    told = ", ".join(sensors)
    said = "their messages bring a covariance of their own, which no sigma changes: where their NIS is wrong"
    return [f"{told}: {said}, correct the driver"] if sensors else []
