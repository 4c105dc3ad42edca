"""Faults of the simulated sensors: what may happen to a sample between the sensor and who reads it.

A fault acts on samples taken from ``start`` until ``end``. Its kinds, and the settings that each reads:

    ok            nothing happens
    off           no samples: the plug is out
    stuck         the value of the first sample stays, with new stamps
    garbage       a ``share`` of the samples is off by ``spike`` sigmas, either way
    wrong         ``factor`` (a unit, a sign; of a pose its position), then a saturation at ``limit``; the
                  stamp is off by ``stamp``; it comes under the name ``named`` (two of these: swapped plugs)
    slow          at most ``rate_hz`` samples per second
    delayed       arrives ``delay`` after it was taken, ``jitter`` sooner or later
    intermittent  silent for a ``share`` of every ``period``
    bias          the first channel is off by ``bias``, reached after ``ramp``
    nan           a ``share`` of the samples has ``value`` in every channel

Chance has its own stream for each sensor, so a fault changes neither its noise nor the other sensors.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.sim.sample import Sample, ticks_until_heard
from flexarm_model.manipulator.sensor_kinds import ROTATION
from flexarm_model.manipulator.sensor_spec import SensorSpec

Array = NDArray[np.float64]
_SLACK = 1e-9  # s; ticks are rounded


@dataclass(frozen=True)
class SensorFault:
    """What is wrong with one sensor, and when.

    Attributes:
        kind: One of ``KINDS``.
        start, end: The fault acts on samples taken from ``start`` until before ``end`` [s].
        share: Of the samples, or of the period [1].
        spike: Size of a spike, in sigmas of the description [1].
        factor: On the value [1]; -1 is a flipped sign, 1000 millimetres for metres.
        limit: Values saturate here, either way, SI.
        named: Sensor under whose name the samples come; empty for its own.
        stamp: Error of the stamp [s].
        rate_hz: Samples per second at most [Hz].
        delay: Time from sample to arrival, instead of that of the description [s].
        jitter: The delay varies evenly by so much either way [s].
        period: Of an intermittent fault [s].
        bias: Offset, SI.
        ramp: Time in which the offset grows from zero; 0 is a step [s].
        value: What every channel says, SI.
    """

    kind: str = "ok"
    start: float = 0.0
    end: float = math.inf
    share: float = 1.0
    spike: float = 50.0
    factor: float = 1.0
    limit: float = math.inf
    named: str = ""
    stamp: float = 0.0
    rate_hz: float = 1.0
    delay: float = 0.0
    jitter: float = 0.0
    period: float = 1.0
    bias: float = 0.0
    ramp: float = 0.0
    value: float = math.nan

    def __post_init__(self) -> None:
        """Refuse what cannot be meant.

        Raises:
            ValueError: A setting is out of range; names it and what is allowed.
        """
        if self.kind not in KINDS:
            raise ValueError(f"kind '{self.kind}' is not one of {', '.join(KINDS)}")
        if not 0.0 <= self.start < self.end:
            raise ValueError(f"start {self.start:g} s, end {self.end:g} s: need 0 <= start < end")
        if not 0.0 <= self.share <= 1.0:
            raise ValueError(f"share {self.share:g} is not in [0, 1]")
        for name in ("rate_hz", "period", "limit"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} {getattr(self, name):g} must be above 0")
        for name in ("delay", "jitter", "ramp", "spike"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise ValueError(f"{name} {getattr(self, name):g} must be finite and at least 0")

    def acts_at(self, t: float) -> bool:
        """Return whether a sample taken at ``t`` [s] is touched."""
        return self.start - _SLACK <= t < self.end - _SLACK


class Arrival(NamedTuple):
    """A sample and the tick at which it arrives."""

    tick: int
    sample: Sample


class FaultLine:
    """The line from one sensor, with its fault.

    Attributes:
        touched: Samples that were lost, changed or delayed so far.
    """

    def __init__(self, fault: SensorFault, spec: SensorSpec, dt: float, seed: int) -> None:
        """Lay the line.

        Args:
            fault: What is wrong with it.
            spec: The sensor.
            dt: Control period [s].
            seed: Of the whole rig.
        """
        self.fault, self.spec, self.dt = fault, spec, dt
        self.rng = np.random.default_rng([seed, zlib.crc32(spec.name.encode()), zlib.crc32(b"fault")])
        self.held: Array | None = None
        self.next_due = -math.inf
        self.touched = 0

    def carry(self, arrival: Arrival) -> list[Arrival]:
        """Return what arrives instead of a sample, and when; nothing when it is lost."""
        if not self.fault.acts_at(arrival.sample.tick * self.dt):
            return [arrival]
        carried = _CARRY[self.fault.kind](self, arrival)
        self.touched += not (carried and carried[0] is arrival)
        return carried

    def hits(self) -> bool:
        """Return whether chance picks this sample."""
        return bool(self.rng.random() < self.fault.share)


def known_faults(faults: Mapping[str, SensorFault], sensors: Sequence[SensorSpec]) -> dict[str, SensorFault]:
    """Return the faults by sensor.

    Args:
        faults: By sensor.
        sensors: Those of the manipulator.

    Raises:
        ValueError: A name is that of no sensor, or stands for no fault; says what is allowed.
    """
    names = [spec.name for spec in sensors]
    for name, fault in faults.items():
        if name not in names:
            raise ValueError(f"faults: '{name}' is not one of {', '.join(names) or 'no sensors'}")
        if not isinstance(fault, SensorFault):
            raise ValueError(f"faults: {name}: expected a SensorFault, not {fault!r}")
    return dict(faults)


def _ok(line: FaultLine, arrival: Arrival) -> list[Arrival]:
    return [arrival]


def _off(line: FaultLine, arrival: Arrival) -> list[Arrival]:
    return []


def _stuck(line: FaultLine, arrival: Arrival) -> list[Arrival]:
    line.held = arrival.sample.y.copy() if line.held is None else line.held
    return [_saying(arrival, line.held)]


def _garbage(line: FaultLine, arrival: Arrival) -> list[Arrival]:
    if not line.hits():
        return [arrival]
    signs = line.rng.choice([-1.0, 1.0], arrival.sample.y.size)
    return [_saying(arrival, arrival.sample.y + signs * line.fault.spike * line.spec.sigma)]


def _wrong(line: FaultLine, arrival: Arrival) -> list[Arrival]:
    fault, sample = line.fault, arrival.sample
    place = [channel not in ROTATION for channel in line.spec.channels]  # no factor, no limit turns a pose
    y = sample.y.copy()
    y[place] = np.clip(fault.factor * y[place], -fault.limit, fault.limit)
    told = sample._replace(y=y, sensor=fault.named or sample.sensor)
    return [Arrival(arrival.tick, told.stamped_later(fault.stamp, line.dt))]


def _slow(line: FaultLine, arrival: Arrival) -> list[Arrival]:
    t = arrival.sample.tick * line.dt
    if t < line.next_due - _SLACK:
        return []
    period = 1.0 / line.fault.rate_hz
    line.next_due = (max(line.next_due, t - period) if math.isfinite(line.next_due) else t) + period
    return [arrival]


def _delayed(line: FaultLine, arrival: Arrival) -> list[Arrival]:
    delay = line.fault.delay + line.fault.jitter * line.rng.uniform(-1.0, 1.0)
    return [Arrival(arrival.sample.tick + ticks_until_heard(delay, line.dt), arrival.sample)]


def _intermittent(line: FaultLine, arrival: Arrival) -> list[Arrival]:
    fault = line.fault
    since = arrival.sample.tick * line.dt - fault.start
    is_silent = math.fmod(since + _SLACK, fault.period) < fault.share * fault.period
    return [] if is_silent else [arrival]


def _bias(line: FaultLine, arrival: Arrival) -> list[Arrival]:
    fault, y = line.fault, arrival.sample.y.copy()
    since = max(arrival.sample.tick * line.dt - fault.start, 0.0)  # rounding lets it be just before
    y[0] += fault.bias * (1.0 if since >= fault.ramp else since / fault.ramp)
    return [_saying(arrival, y)]


def _nan(line: FaultLine, arrival: Arrival) -> list[Arrival]:
    if not line.hits():
        return [arrival]
    return [_saying(arrival, np.full_like(arrival.sample.y, line.fault.value))]


def _saying(arrival: Arrival, y: Array) -> Arrival:
    return Arrival(arrival.tick, arrival.sample._replace(y=y))


_CARRY: dict[str, Callable[[FaultLine, Arrival], list[Arrival]]] = {
    "ok": _ok,
    "off": _off,
    "stuck": _stuck,
    "garbage": _garbage,
    "wrong": _wrong,
    "slow": _slow,
    "delayed": _delayed,
    "intermittent": _intermittent,
    "bias": _bias,
    "nan": _nan,
}
KINDS = tuple(_CARRY)
