"""A test stand: one machine, its recorded motion, and the estimator run over it with faulty samples."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.fault_drill.motion_record import DrilledArm, MotionRecord, drilled_arm, record_motion
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.sim.sensor_faults import Arrival, FaultLine, SensorFault
from flexarm_estimator.estimate import Estimate, SensorReport
from flexarm_estimator.estimator import Estimator
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.manipulator.sensor_spec import SensorSpec

if TYPE_CHECKING:
    from flexarm_bringup.fault_drill.message_stand import MessageStand

Array = NDArray[np.float64]
Faults = Mapping[str, SensorFault]
Change = Callable[[int, list[Measurement]], list[Measurement]]
FAULT_START, FAULT_END = 2.5, 4.5  # s; in the middle of a move, and two seconds later


class Skipped(Exception):  # noqa: N818 - it is not an error
    """A row cannot be played here; the message says why."""


@dataclass(frozen=True)
class Trace:
    """What the estimator said over a record.

    Attributes:
        t: Times of the record [s], (k,).
        error: Distance of the estimated tip from the true one [m], (k,).
        sigma: One sigma of that distance as published [m], (k,).
        estimates: Everything it said, (k,).
        touched: Samples that a fault touched, by sensor.
        refused: Samples refused before the filter saw them, by sensor; None where nobody tells.
    """

    t: Array
    error: Array
    sigma: Array
    estimates: tuple[Estimate, ...]
    touched: Mapping[str, int]
    refused: Mapping[str, int] | None = None

    def rms(self, start: float = FAULT_START, end: float = FAULT_END) -> float:
        """Return the RMS tip error from ``start`` to ``end`` [m]."""
        inside = (self.t >= start) & (self.t < end)
        return float(np.sqrt(np.mean(self.error[inside] ** 2)))

    def report(self, k: int, sensor: str) -> SensorReport:
        """Return the health of a sensor at tick ``k``."""
        return next(report for report in self.estimates[k].sensors if report.name == sensor)

    def tick(self, t: float) -> int:
        """Return the first tick at or after ``t`` [s]."""
        return int(np.searchsorted(self.t, t - 1e-9))


class Bench(Protocol):
    """What rows that only inject faults into samples need of a stand, in one process or over DDS."""

    @property
    def dt(self) -> float:
        """Control period [s]."""
        ...

    @property
    def sensors(self) -> tuple[SensorSpec, ...]:
        """Sensors of the machine."""
        ...

    @property
    def nominal(self) -> Trace:
        """The run without any fault."""
        ...

    def of_kind(self, *kinds: str) -> tuple[SensorSpec, ...]:
        """Return the sensors of some kinds."""
        ...

    def play(self, faults: Faults) -> Trace:
        """Return the run with faults, by sensor."""
        ...


class Stand:
    """One machine on the test stand.

    Attributes:
        name: Of the manipulator.
        arm: The machine.
        settings: Of the estimator, as its task has them.
    """

    def __init__(self, name: str, seed: int = 1) -> None:
        """Plan the tour and compile the arm.

        Args:
            name: Of the manipulator.
            seed: Of all noise.

        Raises:
            ConfigError: There is no such manipulator.
        """
        self.name, self.seed = name, seed
        self.simulation = RigSettings(seed=seed)
        self.arm: DrilledArm = drilled_arm(name, self.simulation)
        self.settings = self.arm.task.make("estimator", EstimatorConfig)

    @cached_property
    def record(self) -> MotionRecord:
        """The motion without any fault."""
        return record_motion(self.arm, self.simulation)

    @cached_property
    def nominal(self) -> Trace:
        """The estimator over that record: its RMS tip error is e0."""
        return self.play()

    @property
    def dt(self) -> float:
        """Control period [s]."""
        return self.record.dt

    @property
    def sensors(self) -> tuple[SensorSpec, ...]:
        """Sensors of the machine."""
        return self.arm.config.sensors

    @property
    def messages(self) -> MessageStand:
        """The same machine at message level.

        Raises:
            Skipped: The message types are not installed.
        """
        try:
            from flexarm_bringup.fault_drill.message_stand import MessageStand
        except ImportError as error:
            raise Skipped(f"needs ROS and flexarm_interfaces: {error}") from None
        return MessageStand(self)

    def of_kind(self, *kinds: str) -> tuple[SensorSpec, ...]:
        """Return the sensors of some kinds."""
        return tuple(spec for spec in self.sensors if spec.kind in kinds)

    def estimator(self, settings: EstimatorConfig | None = None, without: Sequence[str] = ()) -> Estimator:
        """Return a new estimator of the machine, without the sensors of some kinds."""
        sensors = tuple(spec for spec in self.sensors if spec.kind not in without)
        return Estimator(self.record.model, self.arm.tree, sensors, settings or self.settings)

    def touched(self, faults: Faults) -> dict[str, int]:
        """Return how many samples of the record faults touch, by sensor."""
        lines = self._lines(faults)
        for arrival in self.record.arrivals:
            lines[arrival.sample.sensor].carry(arrival)
        return {name: lines[name].touched for name in faults}

    def _lines(self, faults: Faults) -> dict[str, FaultLine]:
        return {
            spec.name: FaultLine(faults.get(spec.name, SensorFault()), spec, self.dt, self.seed)
            for spec in self.sensors
        }

    def play(
        self,
        faults: Faults | None = None,
        *,
        estimator: Estimator | None = None,
        record: MotionRecord | None = None,
        change: Change | None = None,
        clock: Callable[[float], float] = float,
    ) -> Trace:
        """Run the estimator over a record with faults in its samples.

        Args:
            faults: By sensor.
            estimator: A new one with other settings or fewer sensors; None for the usual one.
            record: Another run of the same machine; None for the usual one.
            change: Changes what arrives at a tick, after the faults have.
            clock: Time of the estimator and of all stamps as a function of that of the record [s].
        """
        record, estimator = record or self.record, estimator or self.estimator()
        lines = self._lines(faults or {})
        arriving = _by_tick(record.arrivals, lines, len(record.t))
        estimates = []
        for k, t in enumerate(record.t):
            if k in record.served:
                estimator.adopt(record.served[k])
            samples = [_measured(arrival, record.dt, clock) for arrival in arriving[k]]
            samples = samples if change is None else change(k, samples)
            estimates.append(estimator.step(samples, record.tau[k], clock(float(t))))
        touched = {name: line.touched for name, line in lines.items()}
        counts = estimator.health.refusals.counts
        refused = {name: sum(reasons.values()) for name, reasons in counts.items()}
        return replace(trace_of(record.t, record.tip, estimates, touched), refused=refused)


def _by_tick(arrivals: Sequence[Arrival], lines: Mapping[str, FaultLine], n: int) -> list[list[Arrival]]:
    """Return what arrives at every tick when the lines have carried it."""
    arriving: list[list[Arrival]] = [[] for _ in range(n)]
    for arrival in arrivals:
        for carried in lines[arrival.sample.sensor].carry(arrival):
            if carried.tick < n:
                arriving[carried.tick].append(carried)
    return arriving


def _measured(arrival: Arrival, dt: float, clock: Callable[[float], float]) -> Measurement:
    sample = arrival.sample
    return Measurement(sample.sensor, clock(sample.tick * dt + 1e-9 * sample.late_ns), sample.y)


def trace_of(t: Array, tip: Array, estimates: Sequence[Estimate], touched: Mapping[str, int]) -> Trace:
    """Return a trace.

    Args:
        t: Times [s], (k,).
        tip: Where the tip really was [m], (k, 3).
        estimates: What the estimator said, (k,).
        touched: Samples that a fault touched, by sensor.
    """
    told = np.array([estimate.T_world_tip[:3, 3] for estimate in estimates])
    variance = np.array([np.trace(estimate.cov_tip_pose[:3, :3]) for estimate in estimates])
    error = np.linalg.norm(told - tip, axis=1)
    return Trace(t, error, np.sqrt(np.maximum(variance, 0.0)), tuple(estimates), touched)
