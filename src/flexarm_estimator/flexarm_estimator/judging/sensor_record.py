"""What is known of one sensor, and the report made of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.estimate import SensorReport, SensorStatus
from flexarm_estimator.late_sensors import MS
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.manipulator.sensor_spec import SensorSpec

Array = NDArray[np.float64]
_PERIODS = 3.0  # sample periods of silence that are normal
_LATE = 0.125  # of the time-out: a tick of the loop, in which a sample is heard that has come


@dataclass(slots=True)
class SensorRecord:
    """What is known of one sensor."""

    latency: float  # as described [s]
    period: float  # between two samples [s]; 0 where it keeps up with the loop
    time_out: float
    last_hope: float  # age up to which it carries the estimate alone [s]
    innovation: Array
    locates: int  # bit of a sensor that tells where an axis is, see ``Coverage``; 0 for another
    is_off: bool = False
    accepted: int = 0
    rejected: int = 0
    refused_in_a_row: int = 0
    accepted_before: int = 0  # the last that was refused
    first_accepted: float = math.inf
    newest_accepted: float = 0.0
    newest_valid: float = 0.0
    delay: float = 0.0  # age that the newest usable sample had when it came [s]
    reason: str = "no sample yet"
    normalised: float = 0.0
    without: str = ""  # channels that are switched off
    faults: dict[str, str] = field(default_factory=dict)  # why it was put out of use, by watch
    remarks: dict[str, str] = field(default_factory=dict)  # what else watches have to say of it

    @property
    def fault(self) -> str:
        """What all watches have against it."""
        return "; ".join(self.faults.values())

    @property
    def accepted_in_a_row(self) -> int:
        """Samples since the last that was refused."""
        return self.accepted - self.accepted_before

    @property
    def remark(self) -> str:
        """What else they say."""
        return "; ".join([*self.remarks.values(), self.why_old] if self.is_old else self.remarks.values())

    @property
    def is_old(self) -> bool:
        """Its samples come so late that it would seem silent before the next one, though none is missing."""
        return self.delay + self.period > self.time_out

    @property
    def why_old(self) -> str:
        """How late they come."""
        return f"samples are {MS * self.delay:.0f} ms old when they come, latency is {MS * self.latency:g} ms"

    def is_silent(self, t: float) -> bool:
        """Return whether nothing has come for too long at ``t`` [s], however old what comes is."""
        late = self.delay - self.latency
        return t - self.newest_valid > self.time_out + (late if late > 0.0 else 0.0)

    def hear(self, stamp: float, t: float) -> None:
        """Note a sample that can be used, of a ``stamp`` [s], that came at ``t`` [s]."""
        if stamp > self.newest_valid:
            self.newest_valid, self.delay = stamp, t - stamp

    def refuse(self, reason: str) -> None:
        """Count a sample that is not used."""
        self.rejected += 1
        self.refused_in_a_row += 1
        self.accepted_before, self.reason = self.accepted, reason


def time_out(spec: SensorSpec, config: EstimatorConfig) -> float:
    """Return the silence of a sensor that is normal [s]."""
    return spec.latency + max(config.time_out, _PERIODS * period(spec))


def last_hope(spec: SensorSpec, config: EstimatorConfig) -> float:
    """Return the silence up to which a sensor carries the estimate alone [s].

    Where ``_PERIODS`` of its samples are longer than ``time_out`` it ends as soon as the next one is late.
    """
    is_slow = _PERIODS * period(spec) > config.time_out
    return spec.latency + (period(spec) + _LATE * config.time_out if is_slow else config.time_out)


def period(spec: SensorSpec) -> float:
    """Return the time between two samples [s]; 0 for a sensor that keeps up with the loop."""
    return 1.0 / spec.rate_hz if spec.rate_hz > 0.0 else 0.0


def report(name: str, record: SensorRecord, t: float) -> SensorReport:
    """Return the health of a sensor at ``t`` [s]."""
    status: SensorStatus = "ok"
    reason, age = record.reason, t - record.newest_accepted
    age = age if age > 0.0 else 0.0
    if record.is_off:
        status, reason = "off", "switched off"
    elif record.faults:
        status, reason = "faulty", "; ".join(said for said in (record.fault, record.remark) if said)
    elif record.is_silent(t):
        status, reason = "stale", f"silent ({reason})" if reason else "silent"
    elif reason:
        status = "rejected"
    elif record.remarks or record.is_old:
        reason = record.remark
    elif record.without:
        reason = f"{record.without} switched off"
    return SensorReport(
        name, status, reason, age, record.accepted, record.rejected, record.innovation, record.normalised
    )
