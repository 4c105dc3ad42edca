"""The recent past: instants with their torque, samples and beliefs, so that late samples find their place.

Every instant keeps what is needed to compute it again from the one before. A late sample is put
into the instant of its stamp (a new one splits an interval; the torque of that interval holds on
both sides), and all later instants are computed again. The oldest instant is the fixed start.

Every instant belongs to the served model of its time. Where another one was adopted stands an instant
of its own, at which nothing is sampled: the same time, the state in the coordinates of the new model.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filter import Belief
from flexarm_estimator.judging.reopening import Reopening
from flexarm_estimator.judging.scan import Scan
from flexarm_estimator.measurement import SAME_INSTANT, Measurement
from flexarm_estimator.state.state_map import StateMap
from flexarm_estimator.steps.joint_step import PreparedStep

if TYPE_CHECKING:
    from flexarm_estimator.parts import Parts

Array = NDArray[np.float64]
_NOTHING: Array = np.empty(0)


@dataclass(slots=True)
class Instant:
    """A point in time at which something was sampled or asked for.

    Attributes:
        t: [s].
        u: [tau; 1] held over the interval that ends here, (n_u + 1,).
        parts: Of the served model in whose coordinates the belief is.
        belief: State at ``t`` given all samples up to ``t``.
        fused: Samples that belong to the state, by sensor.
        pending: Samples not judged yet, by sensor.
        refused: Samples that do not belong to the state, by sensor; kept for who looks for the one at fault.
        inputs: ``u`` as the filter sees it, with its own inputs in front; empty before the first time.
        scan: Samples that came together; those of its sensors are among the others here, if any.
        prepared: Joint step that leads here, kept for computing again; None when it has to be made.
        reopening: The covariance was widened here because the state was doubted; None where it was not.
        entry: Leads here from the instant before, which belongs to another model; None within one.
    """

    t: float
    u: Array
    parts: Parts
    belief: Belief
    fused: dict[str, Measurement] = field(default_factory=dict)
    pending: dict[str, Measurement] = field(default_factory=dict)
    refused: dict[str, Measurement] = field(default_factory=dict)
    reopening: Reopening | None = None
    inputs: Array = field(default_factory=lambda: _NOTHING)
    scan: Scan | None = None
    prepared: PreparedStep | None = None
    entry: StateMap | None = None

    def accept(self, belief: Belief) -> None:
        """Take the state that all pending samples have led to; none had been fused before."""
        self.belief = belief
        self.fused, self.pending = self.pending, self.fused

    @property
    def is_reopened(self) -> bool:
        """The state was doubted here."""
        return self.reopening is not None


class History:
    """Instants in order of time; the last one is now."""

    def __init__(self, start: Instant, length: float) -> None:
        """Begin with the fixed instant ``start`` and keep ``length`` seconds."""
        self.instants = [start]
        self._length = length

    @property
    def now(self) -> Instant:
        """The newest instant."""
        return self.instants[-1]

    @property
    def oldest(self) -> float:
        """Time of the fixed start; only later samples can be fused [s]."""
        return self.instants[0].t

    def advance(self, t: float, u: Array) -> int:
        """Go to ``t`` with ``u`` (n_u + 1,) held since then; return the index of the first to compute."""
        now, count = self.instants[-1], len(self.instants)
        if t > now.t + SAME_INSTANT:
            self.instants.append(
                Instant(t, u, now.parts, now.belief, {}, {}, {}, None, _NOTHING)
            )  # faster than by default arguments
        return count

    def enter(self, parts: Parts, entry: StateMap) -> None:
        """Go on with the parts of another model, into whose coordinates ``entry`` leads."""
        now = self.instants[-1]
        belief, inputs = entry.apply(now.belief), now.inputs
        self.instants.append(Instant(now.t, now.u, parts, belief, inputs=inputs, entry=entry))

    def insert(self, sample: Measurement) -> int:
        """Put a sample into the instant of its stamp; return the index of that instant.

        ``sample.t`` lies between ``oldest`` and now.
        """
        index = self._split(sample.t)
        self.instants[index].pending[sample.sensor] = sample
        return index

    def insert_scan(self, scan: Scan) -> int:
        """Put the samples of a scan into its instant as ``insert`` does; return the index of that instant."""
        index = self._split(scan.t)
        instant = self.instants[index]
        instant.pending.update(zip(scan.sensors, scan.samples, strict=True))
        instant.scan = scan
        return index

    def _split(self, t: float) -> int:
        """Return the index of the instant at ``t`` [s], which is made if it is not there."""
        instants = self.instants
        index = len(instants) - 1
        if index > 1 and instants[-2].t >= t - SAME_INSTANT:  # most samples are of now
            index = max(1, bisect_left(instants, t - SAME_INSTANT, hi=index, key=_time))
        while index < len(instants) and instants[index].entry is not None:  # nothing is sampled there
            index += 1
        after = instants[min(index, len(instants) - 1)]
        if index == len(instants) or after.t - t > SAME_INSTANT:
            instants.insert(index, Instant(t, after.u, after.parts, instants[index - 1].belief))
        return index

    def withdraw(self, sensor: str, since: float) -> int:
        """Take a sensor's samples from ``since`` [s] on out; return the first instant to compute again.

        What lies before the fixed start cannot be changed any more.
        """
        touched = len(self.instants)
        for index in range(len(self.instants) - 1, 0, -1):
            instant = self.instants[index]
            if instant.t < since - SAME_INSTANT:
                break
            instant.refused.pop(sensor, None)
            if instant.fused.pop(sensor, None) is not None:
                instant.prepared, touched = None, index
        return touched

    def forget(self, needed: float = math.inf) -> None:
        """Drop what is older than the history and ``needed`` [s], but never the last instant before it."""
        instants = self.instants
        horizon, needed = instants[-1].t - self._length, needed - SAME_INSTANT
        horizon = horizon if horizon < needed else needed
        while len(instants) > 2 and instants[1].t <= horizon:
            del instants[0]


def _time(instant: Instant) -> float:
    return instant.t
