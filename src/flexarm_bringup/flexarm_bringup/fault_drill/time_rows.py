"""Rows about when: impacts, clocks that jump, stamps in the future, out of order, too old, doubled."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flexarm_bringup.fault_drill.findings import Finding, Trial, lost_within, refused_exactly, tip_within
from flexarm_bringup.fault_drill.motion_record import record_motion
from flexarm_bringup.fault_drill.row import Case, Row, cases, every
from flexarm_bringup.fault_drill.stand import FAULT_END, FAULT_START, Skipped, Stand, Trace
from flexarm_bringup.sim.sensor_faults import SensorFault
from flexarm_estimator.measurement import Measurement

CAMERA, ENCODER = "camera", "encoder"
KICK = 0.05  # of every axis' velocity limit: what a blow adds within one period
AFTER_KICK = 1.0  # s in which all sensors must be fused again
UNGATED = 100.0  # sigma; no sample is as far off as that
LATE = 20  # ticks by which one sample overtakes another
TOO_LATE = 0.5  # s; older than any history here
BACK = 0.2  # s


def impact(stand: Stand) -> list[Finding]:
    """Hit the arm: a torque of one period that nobody knows of."""
    model, dt = stand.record.model, stand.record.dt
    k = round(FAULT_START / dt)
    gain = KICK * np.array([axis.velocity for axis in stand.arm.config.actuated.values()])
    blow = model.M[: model.n_theta, : model.n_theta] @ gain / dt
    record = record_motion(stand.arm, stand.simulation, {k: blow})
    gated = stand.play(record=record)
    ungated = stand.play(record=record, estimator=stand.estimator(replace(stand.settings, gate=UNGATED)))
    end = FAULT_START + AFTER_KICK
    return [
        Finding("refusals in a row, any sensor", _longest_refusal(gated, FAULT_START, end), 6),
        Finding("peak / peak without a gate", _peak(gated, end) / _peak(ungated, end), 2.0),
    ]


def jump(stand: Stand, by: float) -> list[Finding]:
    """Let all clocks jump by some seconds."""
    trace = stand.play(clock=lambda t: t if t < FAULT_START - 1e-9 else t + by)
    k = trace.tick(FAULT_START)
    after = trace.estimates[k:]
    back = next((i for i in range(len(after)) if _is_good(trace, k + i)), math.inf)
    grown = trace.sigma[k] / trace.sigma[k - 1]
    steps = np.diff([estimate.t for estimate in after])
    return [
        Finding("time went back after the jump, steps", int(np.sum(steps < 0.0)), 0),
        Finding("largest step of the output afterwards", float(steps.max()), 0.1, "s"),
        Finding("sigma at the jump / before: starts anew", float(grown), 10.0, at_least=True),
        Finding("output good again after", back * stand.record.dt, BACK, "s"),
    ]


def swapped(stand: Stand) -> list[Finding]:
    """Let one sample of every gauge and encoder arrive after the one 20 ticks later."""
    k = _quiet_tick(stand)
    held: list[Measurement] = []

    def change(tick: int, samples: list[Measurement]) -> list[Measurement]:
        """Hold the samples of one instant back for some ticks."""
        if tick == k:
            held.extend(sample for sample in samples if sample.sensor in names)
            return [sample for sample in samples if sample.sensor not in names]
        return [*samples, *held] if tick == k + LATE else samples

    names = [spec.name for spec in stand.of_kind("strain_gauge", ENCODER)]
    trace = stand.play(change=change)
    late, usual = trace.estimates[k + LATE], stand.nominal.estimates[k + LATE]
    missed = np.max(np.abs(trace.estimates[k + LATE - 1].x - stand.nominal.estimates[k + LATE - 1].x))
    scale = np.sqrt(np.diag(usual.P))
    off = max(
        float(np.max(np.abs(late.x - usual.x))),
        float(np.max(np.abs(late.P - usual.P) / np.outer(scale, scale))),
    )
    return [
        Finding(f"difference to the run in order, {len(held)} samples", off, 1e-9),
        Finding("the same before they arrive", float(missed), 1e-8, at_least=True),
    ]


def too_old(stand: Stand) -> list[Finding]:
    """Repeat samples of long ago with other values and stamps."""
    k = round(FAULT_START / stand.record.dt)
    old = [
        Measurement(
            arrival.sample.sensor, arrival.sample.tick * stand.record.dt + 1e-3, arrival.sample.y + 1e-3
        )
        for arrival in stand.record.arrivals
        if arrival.tick == k - round(TOO_LATE / stand.record.dt)
    ]
    trace = stand.play(change=lambda tick, samples: [*samples, *old] if tick == k else samples)
    pairs = list(zip(trace.estimates, stand.nominal.estimates, strict=True))
    differ = sum(not (np.array_equal(a.x, b.x) and np.array_equal(a.P, b.P)) for a, b in pairs)
    counted = _rejected(trace) - _rejected(stand.nominal)
    return [
        Finding("estimates that differ in any bit", differ, 0),
        Finding(f"refused / {len(old)} injected", counted / len(old), 1.0, at_least=True),
    ]


def doubled(stand: Stand) -> list[Finding]:
    """Let every sample arrive twice."""
    trace = stand.play(change=lambda tick, samples: [*samples, *samples])
    trial = Trial(stand, trace, (), FAULT_START, FAULT_END)
    extra = _rejected(trace) - _rejected(stand.nominal)
    expected = sum(1 for _ in stand.record.arrivals)
    return [Finding("doubles not dropped", abs(expected - extra), 0), tip_within(1.05)(trial)]


def _quiet_tick(stand: Stand) -> int:
    """Return a tick with no change of the model in the next ``LATE`` ticks."""
    first = round(FAULT_START / stand.record.dt)
    for k in range(first, len(stand.record.t) - LATE):
        if not any(k <= served <= k + LATE for served in stand.record.served):
            return k
    raise Skipped("the model changes all the time")


def _is_good(trace: Trace, k: int) -> bool:
    usable = trace.estimates[k].is_usable
    return usable and bool(trace.error[k] <= 3.0 * trace.sigma[k])


def _rejected(trace: Trace) -> int:
    return sum(report.rejected for report in trace.estimates[-1].sensors)


def _longest_refusal(trace: Trace, start: float, end: float) -> int:
    """Return the largest number of samples of one sensor that were refused in a row."""
    longest = 0
    for i, _ in enumerate(trace.estimates[0].sensors):
        reports = [estimate.sensors[i] for estimate in trace.estimates[trace.tick(start) : trace.tick(end)]]
        longest = max(longest, _longest_run([(r.accepted, r.rejected) for r in reports]))
    return longest


def _longest_run(counts: Sequence[tuple[int, int]]) -> int:
    run = longest = 0
    for (fused_before, refused_before), (fused, refused) in zip(counts[:-1], counts[1:], strict=True):
        run = 0 if fused > fused_before else run + refused - refused_before
        longest = max(longest, run)
    return longest


def _peak(trace: Trace, end: float) -> float:
    return float(trace.error[trace.tick(FAULT_START) : trace.tick(end)].max())


FUTURE = SensorFault("wrong", stamp=10.0)
ROWS = (
    Row(
        20, "impact that no model knows", "every sensor fused again after five refusals; no lock-out", impact
    ),
    Row(22, "clock jumps by -50 s", "history cleared, no step back, output back", lambda s: jump(s, -50.0)),
    Row(23, "clock jumps by +100 s", "starts anew without a long prediction", lambda s: jump(s, 100.0)),
    Row(
        24,
        "stamps 10 s in the future",
        "refused; lost when all sensors do it",
        cases(
            Case(
                every("encoder", "strain_gauge", "accelerometer", CAMERA),
                FUTURE,
                (refused_exactly, lost_within(0.1)),
                end=FAULT_START + 0.3,
            )
        ),
    ),
    Row(25, "samples out of order by 20 ticks", "the state of the run in order", swapped),
    Row(26, "samples older than the history", "ignored bit for bit, counted", too_old),
    Row(27, "every sample twice", "the second one dropped", doubled),
)
