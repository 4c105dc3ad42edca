"""Rows about the camera's frames: late, jittering, rare, now and then."""

from __future__ import annotations

import math
from dataclasses import replace

from flexarm_bringup.fault_drill.findings import Finding, Measure, Trial, tip_within
from flexarm_bringup.fault_drill.row import Case, Row, cases, every, together
from flexarm_bringup.fault_drill.stand import Change, Stand
from flexarm_bringup.sim.sensor_faults import SensorFault
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.settings import EstimatorConfig

CAMERA, ENCODER = "camera", "encoder"
DELAYS, JITTER = (0.030, 0.060, 0.100), 0.020  # s
UNGATED = 100.0  # sigma; no sample is as far off as that


def far_from_naive(stand: Stand) -> list[Finding]:
    """Delay the camera of an arm without encoders; compare with frames that are taken as of their arrival."""
    findings = []
    for delay in DELAYS:
        ratio = _blind(stand, delay, _without_encoders(stand)) / _naive(stand, delay)
        findings.append(Finding(f"{_ms(delay)}, no encoder: tip RMS / naive", ratio, 0.2))
    return findings


def jitter(stand: Stand) -> list[Finding]:
    """Let the delay of the frames vary; compare with no delay and with one that does not vary."""
    findings, e0 = [], stand.nominal.rms()
    for delay in DELAYS:
        steady, varying = (stand.play(_delayed(stand, delay, spread)).rms() for spread in (0.0, JITTER))
        name = f"{_ms(delay)} ± {_ms(JITTER)}: tip RMS"
        findings += [
            Finding(f"{name} / e0", varying / e0, 1.05),
            Finding(f"{name} / steady", varying / steady, 1.1),
        ]
    return findings


def frames_lost(delay: float) -> Measure:
    """Measure how many frames less were fused than without the delay, beside those still under way."""

    def measure(trial: Trial) -> Finding:
        """Count to the end of the record."""
        sound, late = trial.stand.nominal, trial.trace
        lost = sum(sound.report(-1, s).accepted - late.report(-1, s).accepted for s in trial.sensors)
        rates = (s.rate_hz or 1.0 / trial.stand.dt for s in trial.stand.sensors if s.name in trial.sensors)
        under_way = sum(math.ceil(delay * rate) for rate in rates)
        return Finding(trial.name("frames lost"), max(lost - under_way, 0), 0)

    return measure


def flapping(trial: Trial) -> Finding:
    """Measure how often the status changes."""
    inside = [
        estimate.status
        for estimate, t in zip(trial.trace.estimates, trial.trace.t, strict=True)
        if trial.start <= t < trial.end
    ]
    changes = sum(a != b for a, b in zip(inside[:-1], inside[1:], strict=True))
    return Finding(
        trial.name("changes of status per second"), changes / (trial.end - trial.start), 2.0, "1/s"
    )


def _naive(stand: Stand, delay: float) -> float:
    """Return the tip error with frames taken as of their arrival, gated or not: the better one [m]."""
    change, ungated = _as_of_arrival(stand), replace(stand.settings, gate=UNGATED)
    return min(_blind(stand, delay, change), _blind(stand, delay, change, ungated))


def _blind(stand: Stand, delay: float, change: Change, settings: EstimatorConfig | None = None) -> float:
    """Return the RMS tip error of an estimator that has no encoders [m]."""
    estimator = stand.estimator(settings, without=(ENCODER,))
    return stand.play(_delayed(stand, delay, 0.0), estimator=estimator, change=change).rms()


def _delayed(stand: Stand, delay: float, spread: float) -> dict[str, SensorFault]:
    fault = SensorFault("delayed", delay=delay, jitter=spread)
    return {spec.name: fault for spec in stand.of_kind(CAMERA)}


def _without_encoders(stand: Stand) -> Change:
    return lambda tick, samples: [s for s in samples if s.sensor not in _names(stand, ENCODER)]


def _as_of_arrival(stand: Stand) -> Change:
    cameras, encoders = _names(stand, CAMERA), _names(stand, ENCODER)

    def change(tick: int, samples: list[Measurement]) -> list[Measurement]:
        """Leave the encoders out and stamp camera frames as they arrive."""
        now = float(stand.record.t[tick])
        kept = [sample for sample in samples if sample.sensor not in encoders]
        return [s._replace(t=now) if s.sensor in cameras else s for s in kept]

    return change


def _ms(seconds: float) -> str:
    return f"{1e3 * seconds:g} ms"


def _names(stand: Stand, kind: str) -> set[str]:
    return {spec.name for spec in stand.of_kind(kind)}


LATE = tuple(
    Case(
        every(CAMERA),
        SensorFault("delayed", delay=delay),
        (tip_within(1.05), frames_lost(delay)),
        f"{_ms(delay)} late",
        throughout=True,
    )
    for delay in DELAYS
)
ROWS = (
    Row(
        28,
        "frames delayed by 30, 60, 100 ms",
        "as good as punctual; far better than naive",
        together(cases(*LATE), far_from_naive),
    ),
    Row(
        29,
        "delay ± 20 ms; camera slowed to 5 Hz",
        "as good as punctual, and as a steady delay; little worse",
        together(
            jitter, cases(Case(every(CAMERA), SensorFault("slow", rate_hz=5.0), (tip_within(1.5),), "5 Hz"))
        ),
    ),
    Row(
        30,
        "camera drops out and in every 0.5 s",
        "no flapping; the tip stays",
        cases(
            Case(
                every(CAMERA), SensorFault("intermittent", period=1.0, share=0.5), (tip_within(1.2), flapping)
            )
        ),
    ),
)
