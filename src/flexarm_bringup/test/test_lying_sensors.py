"""One sensor lies, in every way that a soak knows, moving and at rest: the tip is not lost, and found again.

The arm is held by its drives, so that the motion owes nothing to the estimate. Encoders are told as the rig's
node tells them: what is read at a tick has its stamp, so that a delay of theirs is one that nobody knows of.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest

from flexarm_bringup.fault_drill.motion_record import record_motion
from flexarm_bringup.fault_drill.stand import Stand, Trace
from flexarm_bringup.sim.sensor_faults import Arrival, FaultLine, SensorFault
from flexarm_bringup.soak.script import FAULTS
from flexarm_bringup.static_arm import StaticArm
from flexarm_bringup.tasks.course import plan_course

pytestmark = pytest.mark.slow
ARM, SENSORS = "single_link", ("encoder", "root_strain", "tip_accelerometer", "camera")
REST = 1.2  # s between two moves of the record
STARTS = {"moving": 3.6, "at rest": 2.6}  # s: on the way home, and 0.6 s before it
SHORTEST, LONGEST = 0.8, 1.4  # s, so that the record of 6.5 s shows what comes after
UNFLAGGED = 1e-3  # m: two sigma of the camera, the only sensor that could tell of an encoder
FLAGGED = 5e-3  # m: half of what an encoder that lags by 60 ms is off by, at 0.17 m/s
BACK, AFTER = 5.0, 1.0  # times the error without a fault, so long after its end [s]


@dataclass(frozen=True)
class Lie:
    """A fault of a sensor and what became of it."""

    fault: SensorFault
    trace: Trace

    def largest(self, *status: str) -> float:
        """Return the largest error while the status was one of some [m]."""
        told = [estimate.status in status for estimate in self.trace.estimates]
        return float(self.trace.error[told].max(initial=0.0))


@cache
def stand() -> Stand:
    """Return a stand on which the arm rests between its moves."""
    made = Stand(ARM)
    task = replace(made.arm.task, wait=REST)
    course = plan_course(StaticArm(made.arm.tree), task, 1.0 / made.arm.config.rate_hz)
    made.arm = replace(made.arm, task=task, course=course)
    made.record = record_motion(made.arm, made.simulation)
    return made


def as_told(arrivals: list[Arrival]) -> list[Arrival]:
    """Return what messages tell: of an encoder what is newest at a tick, with the stamp of that."""
    told: dict[tuple[str, int], Arrival] = {}
    for arrival in sorted(arrivals, key=lambda arrival: arrival.tick):
        sample = arrival.sample
        tick = arrival.tick if sample.kind == "encoder" else sample.tick
        told[sample.sensor, tick] = Arrival(arrival.tick, sample._replace(tick=tick))
    return list(told.values())


@cache
def nominal() -> float:
    """Return the RMS tip error without a fault [m]."""
    return stand().nominal.rms(1.0, 6.4)


@cache
def lie(sensor: str, kind: str, doing: str) -> Lie:
    """Play a record with a fault of one sensor."""
    spec = next(spec for spec in stand().sensors if spec.name == sensor)
    rng = np.random.default_rng(zlib.crc32(f"{sensor} {kind} {doing}".encode()))
    start = STARTS[doing]
    end = start + rng.uniform(SHORTEST, LONGEST)
    fault = SensorFault(kind, start=start, end=end, **FAULTS[kind](spec))
    line, record = FaultLine(fault, spec, stand().dt, stand().seed), stand().record
    touched = [
        a for arrival in record.arrivals if arrival.sample.sensor == sensor for a in line.carry(arrival)
    ]
    others = [arrival for arrival in record.arrivals if arrival.sample.sensor != sensor]
    arrivals = sorted([*others, *as_told(touched)], key=lambda arrival: arrival.tick)
    return Lie(fault, stand().play(record=replace(record, arrivals=tuple(arrivals))))


every_lie = pytest.mark.parametrize(
    ("sensor", "kind", "doing"),
    [(sensor, kind, doing) for sensor in SENSORS for kind in FAULTS for doing in STARTS],
)


@every_lie
def test_the_tip_is_as_near_as_its_status_says(sensor: str, kind: str, doing: str) -> None:
    told = lie(sensor, kind, doing)
    assert told.largest("ok") <= UNFLAGGED
    assert told.largest("degraded") <= FLAGGED


@every_lie
def test_a_second_after_the_lie_the_tip_is_known_as_before(sensor: str, kind: str, doing: str) -> None:
    told = lie(sensor, kind, doing)
    after = told.trace.rms(told.fault.end + AFTER, 6.4)
    assert after <= BACK * nominal()
