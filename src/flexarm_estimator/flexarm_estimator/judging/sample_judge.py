"""What the fusion of samples wants of who judges them: ``gate.Gate``, or ``exclusion.replay.ReplayJudge``."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.steps.joint_step import PreparedStep

Array = NDArray[np.float64]
FAR = "far from the prediction"


class Verdict(NamedTuple):
    """What the gate says of one sample.

    Attributes:
        sensor: Name of the sensor.
        t: Stamp of the sample [s].
        is_accepted: Fused or not.
        innovation: (m,).
        normalised: ``sqrt(nu' S^-1 nu / m)`` [1].
        reason: Why it is not fused; empty when it is.
        since: Of a doubt about the sensor: stamp since which it may have been wrong [s].
    """

    sensor: str
    t: float
    is_accepted: bool
    innovation: Array
    normalised: float
    reason: str = ""
    since: float = math.inf


class SampleJudge(Protocol):
    """Who says whether samples are fused."""

    def bound(self, sensor: str) -> float:
        """Return what ``nu' S^-1 nu`` of a sensor may be."""
        ...

    def take_ordinary(self, step: PreparedStep, t: float) -> list[Verdict] | None:
        """Judge the ordinary samples of a step, or leave it to ``decide``."""
        ...

    def judge(self, sensor: str, t: float, nu: Array, S: Array) -> Verdict:
        """Return the verdict on an innovation ``nu`` (m,) of covariance ``S`` (m, m)."""
        ...

    def decide(self, sensor: str, t: float, nu: Array, nis: float) -> Verdict:
        """Return the verdict on an innovation ``nu`` (m,) with ``nis = nu' S^-1 nu``."""
        ...

    def has_doubt(self, verdicts: Iterable[Verdict], t: float) -> bool:
        """Return whether the state is wrong, not the samples."""
        ...

    def note(self, verdicts: Iterable[Verdict]) -> None:
        """Take final verdicts."""
        ...

    def note_reopening(self, verdicts: Iterable[Verdict], t: float) -> tuple[set[str], float]:
        """Take that the covariance was widened; return who asked for it, and since when it was refused."""
        ...
