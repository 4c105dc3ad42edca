"""What came out of a sensor message: samples, and what could not be read of it."""

from __future__ import annotations

from dataclasses import dataclass, field

from flexarm_estimator.measurement import Measurement

STRANGERS = "unknown joint"  # how the reason begins where a message tells of axes of somebody else
MISSING_AXIS = "no joint"  # and where it lacks one of the arm's


@dataclass(frozen=True)
class Refusal:
    """Something in a message that cannot be used.

    Attributes:
        source: Sensor, or topic when it concerns no sensor of the description.
        reason: What is wrong, with names and numbers.
    """

    source: str
    reason: str


@dataclass(frozen=True)
class Reading:
    """Content of one message.

    Attributes:
        samples: For the estimator, which checks values and stamps.
        refusals: To be counted and told.
    """

    samples: list[Measurement] = field(default_factory=list)
    refusals: list[Refusal] = field(default_factory=list)
