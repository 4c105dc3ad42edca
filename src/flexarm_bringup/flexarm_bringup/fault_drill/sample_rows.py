"""Rows about what the samples say: silence, frozen, spikes, numbers that are none, biases, units."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from flexarm_bringup.fault_drill.findings import (
    Finding,
    Measure,
    Trial,
    always_finite,
    counted_exactly,
    flagged_within,
    fused_at_most,
    honest,
    honest_while_usable,
    lost_within,
    refused_exactly,
    silence_told,
    stale_within,
    tip_within,
)
from flexarm_bringup.fault_drill.recovery import recovered_within
from flexarm_bringup.fault_drill.row import Case, Play, Row, cases, every, one, together
from flexarm_bringup.fault_drill.stand import FAULT_END, FAULT_START, Bench
from flexarm_bringup.sim.sensor_faults import SensorFault

GAUGE, ACCELEROMETER, ENCODER, CAMERA = "strain_gauge", "accelerometer", "encoder", "camera"
KINDS = (ENCODER, GAUGE, ACCELEROMETER, CAMERA)
PER_TICK = (ENCODER, GAUGE, ACCELEROMETER)
OFF, STUCK = SensorFault("off"), SensorFault("stuck")
SHARES = {CAMERA: 0.1}  # of the samples; a camera takes too few in two seconds for 2 %
SHARE = 0.02
DENORMAL = 5e-324
G = 9.80665  # m/s^2
IN_DEGREES = SensorFault("wrong", factor=180.0 / math.pi)
OPEN_LOOP_TIME, OPEN_LOOP_ERROR = 0.2, 2e-3  # s, m


def open_loop_error(trial: Trial) -> Finding:
    """Measure the tip error a short time after the arm was last located."""
    k = trial.trace.tick(trial.start + OPEN_LOOP_TIME)
    name = trial.name(f"tip error after {OPEN_LOOP_TIME:g} s")
    return Finding(name, 1e3 * float(trial.trace.error[k]), 1e3 * OPEN_LOOP_ERROR, "mm")


def false_refusals(stand: Bench) -> Finding:
    """Measure the share of sound samples that is refused."""
    reports = stand.nominal.estimates[-1].sensors
    refused, fused = sum(r.rejected for r in reports), sum(r.accepted for r in reports)
    return Finding("nominal: sound samples refused", 100.0 * refused / (refused + fused), 0.1, "%")


def _spikes(stand: Bench) -> list[Finding]:
    every_kind = [
        Case(every(kind), _some(kind, "garbage"), (tip_within(1.05), refused_exactly), kind) for kind in KINDS
    ]
    return [*cases(*every_kind)(stand), false_refusals(stand)]


def _some(kind: str, fault: str, value: float = math.nan) -> SensorFault:
    """Return a fault of a few samples."""
    return SensorFault(fault, share=SHARES.get(kind, SHARE), value=value)


def _numbers(value: float, *measures: Measure) -> Play:
    """Return what puts a number into a few samples of every sensor."""

    def play(stand: Bench) -> list[Finding]:
        """Put the number into samples of every sensor at once."""
        faults = {
            spec.name: replace(_some(spec.kind, "nan", value), start=FAULT_START, end=FAULT_END)
            for spec in stand.sensors
        }
        trial = Trial(stand, stand.play(faults), tuple(faults), FAULT_START, FAULT_END, f"{value:g}")
        return [measure(trial) for measure in measures]

    return play


NAN_CASES = tuple(
    Case(every(kind), _some(kind, "nan"), (tip_within(1.05), counted_exactly, always_finite), kind)
    for kind in KINDS
)
HUGE = tuple(
    _numbers(value, tip_within(1.05), counted_exactly, always_finite)
    for value in (math.inf, -math.inf, 1e308)
)


def shifted_gauge(stand: Bench) -> Sequence[Finding]:
    """Shift the first gauge by ten of its sigmas."""
    sigma = max([float(spec.sigma[0]) for spec in stand.of_kind(GAUGE)[:1]], default=0.0)
    fault = SensorFault("bias", bias=10.0 * sigma)
    return cases(Case(one(GAUGE), fault, (tip_within(1.5), flagged_within(0.2))))(stand)


ROWS = (
    Row(
        1,
        "strain off for 2 s",
        "the tip stays, DEGRADED says which, ok on return",
        cases(Case(every(GAUGE), OFF, (tip_within(1.5), flagged_within(0.05), recovered_within(0.2)))),
    ),
    Row(
        2,
        "accelerometers off for 2 s",
        "the tip stays, ok on return",
        cases(Case(every(ACCELEROMETER), OFF, (tip_within(2.0), recovered_within(0.2)))),
    ),
    Row(
        3,
        "camera off for 2 s, encoders present",
        "the tip stays; STALE after latency and three frames",
        cases(Case(every(CAMERA), OFF, (tip_within(1.2), silence_told))),
    ),
    Row(
        4,
        "encoders off for 2 s",
        "the camera carries on, ok on return",
        cases(Case(every(ENCODER), OFF, (tip_within(5.0), recovered_within(0.2)))),
    ),
    Row(
        5,
        "camera and encoders off",
        "honest covariance, LOST, small error until then",
        cases(Case(every(CAMERA, ENCODER), OFF, (honest(0.99), lost_within(0.3), open_loop_error))),
    ),
    Row(
        7,
        "a strain gauge frozen",
        "excluded after at most ten equal samples",
        cases(Case(one(GAUGE), STUCK, (fused_at_most(10), tip_within(1.5)))),
    ),
    Row(
        8,
        "an accelerometer frozen",
        "excluded after at most ten equal samples",
        cases(Case(one(ACCELEROMETER), STUCK, (fused_at_most(10), tip_within(2.0)))),
    ),
    Row(
        9,
        "an encoder frozen in motion",
        "excluded after at most ten equal samples",
        cases(Case(one(ENCODER), STUCK, (fused_at_most(10), tip_within(5.0)))),
    ),
    Row(
        10,
        "camera frozen, with new stamps",
        "excluded after three frames",
        cases(Case(every(CAMERA), STUCK, (fused_at_most(3), tip_within(1.2)))),
    ),
    Row(11, "spikes of 50 sigma on 2 % of the samples", "all refused, and nothing else", _spikes),
    Row(12, "NaN in 2 % of the samples", "refused, counted, never published", cases(*NAN_CASES)),
    Row(
        13,
        "infinite, 1e308 and denormal numbers in 2 %",
        "refused, counted, never published",
        together(*HUGE, _numbers(DENORMAL, tip_within(1.05), always_finite)),
    ),
    Row(
        14,
        "nothing but NaN for 1 s",
        "treated as silence",
        cases(
            *(
                Case(every(kind), SensorFault("nan"), (stale_within(0.05),), kind, FAULT_START + 1.0)
                for kind in PER_TICK
            )
        ),
    ),
    Row(
        15,
        "strain bias of 10 sigma, a step",
        "flagged; the tip stays",
        shifted_gauge,
    ),
    Row(
        16,
        "accelerometer bias of 1 m/s², a step below the gate",
        "flagged by the consistency of its innovations",
        cases(
            Case(one(ACCELEROMETER), SensorFault("bias", bias=1.0), (tip_within(2.0), flagged_within(1.0)))
        ),
    ),
    Row(
        17,
        "wrong unit: camera in mm, an encoder in degrees, an accelerometer in g",
        "nothing outside the physical range is fused",
        cases(
            Case(
                every(CAMERA),
                SensorFault("wrong", factor=1e3),
                (tip_within(1.1), fused_at_most(0)),
                "camera",
            ),
            Case(
                one(ENCODER),
                IN_DEGREES,
                (tip_within(8.0), flagged_within(0.2), fused_at_most(0), honest_while_usable(0.99)),
                "encoder",
            ),
            Case(
                one(ACCELEROMETER),
                SensorFault("wrong", factor=1.0 / G),
                (tip_within(8.0), flagged_within(0.2)),  # the encoder's: the matrix has none of its own
                "accelerometer",
            ),
        ),
    ),
)
