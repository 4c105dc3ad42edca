"""What was measured against what was wanted, and the measures that most rows of the drill share.

A measure is a function of a ``Trial``: it looks at one run with a fault and returns a ``Finding``.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from flexarm_bringup.fault_drill.stand import Bench, Trace
from flexarm_estimator.estimate import Estimate

ROUNDED = 1.0 + 1e-9  # times a limit: what is beyond it only by rounding is within


@dataclass(frozen=True)
class Finding:
    """One bound and what was found.

    Attributes:
        what: What was measured.
        measured: Result; infinite when it never happened.
        limit: What it may be at most, or must be at least.
        unit: Of both; empty for a ratio or a count.
        at_least: The limit is a lower one.
    """

    what: str
    measured: float
    limit: float
    unit: str = ""
    at_least: bool = False

    @property
    def passed(self) -> bool:
        """Whether the bound was kept, to rounding: times are differences of stamps."""
        if self.at_least:
            return self.measured * ROUNDED >= self.limit
        return self.measured <= self.limit * ROUNDED

    @property
    def bound(self) -> str:
        """The bound as text."""
        if math.isinf(self.limit):
            return "none"
        return f"{'≥' if self.at_least else '≤'} {self.limit:.4g} {self.unit}".strip()


@dataclass(frozen=True)
class Trial:
    """One run with a fault.

    Attributes:
        stand: The machine.
        trace: What the estimator said.
        sensors: Those at fault.
        start, end: Time of the fault [s].
        label: Says which of several runs of a row this is; may be empty.
    """

    stand: Bench
    trace: Trace
    sensors: tuple[str, ...]
    start: float
    end: float
    label: str = ""

    def name(self, what: str) -> str:
        """Return the name of a measure of this run."""
        return f"{self.label}: {what}" if self.label else what

    def counted(self, field: str) -> int:
        """Return by how much a count of all faulty sensors' reports grew since the fault began."""
        first = self.trace.tick(self.start) - 1
        return sum(
            getattr(self.trace.report(-1, name), field) - getattr(self.trace.report(first, name), field)
            for name in self.sensors
        )


Measure = Callable[[Trial], Finding]


def tip_within(factor: float) -> Measure:
    """Measure the RMS tip error while the fault lasts, over e0 (the same time without the fault)."""

    def measure(trial: Trial) -> Finding:
        """Measure it in the time of the fault."""
        e0 = trial.stand.nominal.rms(trial.start, trial.end)
        ratio = trial.trace.rms(trial.start, trial.end) / e0
        return Finding(trial.name("tip RMS / e0"), ratio, factor)

    return measure


def flagged_within(seconds: float) -> Measure:
    """Measure the time until the estimate is not "ok" and names a sensor at fault."""

    def measure(trial: Trial) -> Finding:
        """Measure until a reason names one of the sensors."""
        since = _first(trial, lambda e: e.status != "ok" and any(name in e.reason for name in trial.sensors))
        return Finding(trial.name("flagged after"), since, seconds, "s")

    return measure


def stale_within(seconds: float) -> Measure:
    """Measure the time until every sensor at fault is told to be silent."""

    def measure(trial: Trial) -> Finding:
        """Measure until all of the sensors are told to be stale."""

        def is_stale(e: Estimate) -> bool:
            """Say whether an estimate tells all of them to be stale."""
            return all(r.status == "stale" for r in e.sensors if r.name in trial.sensors)

        return Finding(trial.name("stale after"), _first(trial, is_stale), seconds, "s")

    return measure


def silence_told(trial: Trial) -> Finding:
    """Measure the time until silent sensors are stale: latency and three frames (they have one rate)."""
    spec = next(spec for spec in trial.stand.sensors if spec.name == trial.sensors[0])
    periods = 3.0 / spec.rate_hz if spec.rate_hz else 3.0 * trial.stand.dt
    return stale_within(spec.latency + periods + trial.stand.dt)(trial)


def lost_within(seconds: float) -> Measure:
    """Measure the time until the estimate says that it may not be used."""

    def measure(trial: Trial) -> Finding:
        """Measure until the state is told to be lost."""
        return Finding(trial.name("lost after"), _first(trial, lambda e: e.status == "lost"), seconds, "s")

    return measure


def fused_at_most(count: int) -> Measure:
    """Measure how many of the samples taken while the fault lasted were fused, of the worst sensor."""

    def measure(trial: Trial) -> Finding:
        """Measure what was fused of each sensor in the time of the fault."""
        latency = {spec.name: spec.latency for spec in trial.stand.sensors}
        fused = []
        for name in trial.sensors:  # until then arrives what was taken before
            first, last = (trial.trace.tick(t + latency[name]) - 1 for t in (trial.start, trial.end))
            fused.append(trial.trace.report(last, name).accepted - trial.trace.report(first, name).accepted)
        return Finding(trial.name("bad samples fused"), max(fused), count)

    return measure


def refused_exactly(trial: Trial) -> Finding:
    """Measure by how much the samples refused, beyond those of the sound run, are not those injected."""
    touched = sum(trial.trace.touched[name] for name in trial.sensors)
    refused = trial.counted("rejected") - _without_fault(trial).counted("rejected")
    return Finding(trial.name(f"refusals beside the {touched} injected"), abs(refused - touched), 0)


def counted_exactly(trial: Trial) -> Finding:
    """Measure by how much the count of refusals differs from the count of injected samples.

    Counted are refusals before the filter; where nobody tells them, those that the sound run has not.
    """
    touched = sum(trial.trace.touched[name] for name in trial.sensors)
    if trial.trace.refused is None:
        counted = trial.counted("rejected") - _without_fault(trial).counted("rejected")
    else:
        counted = sum(trial.trace.refused.get(name, 0) for name in trial.sensors)
    return Finding(trial.name(f"refusals beside the {touched} injected"), abs(counted - touched), 0)


def always_finite(trial: Trial) -> Finding:
    """Measure how many of the published estimates have a number that is not finite."""
    bad = sum(not is_finite(estimate) for estimate in trial.trace.estimates)
    return Finding(trial.name("non-finite estimates"), bad, 0)


def honest(share: float) -> Measure:
    """Measure the share of estimates whose tip error is within the three sigmas they publish."""

    def measure(trial: Trial) -> Finding:
        """Measure it in the time of the fault."""
        trace = trial.trace
        inside = (trace.t >= trial.start) & (trace.t < trial.end)
        within = float(np.mean(trace.error[inside] <= 3.0 * trace.sigma[inside]))
        return Finding(trial.name("share within 3 sigma"), within, share, at_least=True)

    return measure


def honest_while_usable(share: float) -> Measure:
    """Measure the share within three sigmas of the estimates that a controller would use; all of none."""

    def measure(trial: Trial) -> Finding:
        """Measure it in the time of the fault."""
        trace = trial.trace
        inside = (trace.t >= trial.start) & (trace.t < trial.end)
        used = inside & np.array([estimate.is_usable for estimate in trace.estimates])
        within = float(np.mean(trace.error[used] <= 3.0 * trace.sigma[used])) if used.any() else 1.0
        return Finding(trial.name("share within 3 sigma while usable"), within, share, at_least=True)

    return measure


def is_finite(estimate: Estimate) -> bool:
    """Return whether every number of an estimate is finite."""
    tip = (estimate.T_world_tip, estimate.twist_tip, estimate.cov_tip_pose, estimate.cov_tip_twist)
    arrays = (estimate.x, estimate.P, *tip, *(report.innovation for report in estimate.sensors))
    return all(bool(np.isfinite(array).all()) for array in arrays)


def _without_fault(trial: Trial) -> Trial:
    """Return the same trial without the fault."""
    return Trial(trial.stand, trial.stand.nominal, trial.sensors, trial.start, trial.end, trial.label)


def _first(trial: Trial, holds: Callable[[Estimate], bool]) -> float:
    """Return the time from the start of the fault until something holds [s]; infinite if never."""
    trace = trial.trace
    for k in range(trace.tick(trial.start), len(trace.t)):
        if holds(trace.estimates[k]):
            return float(trace.t[k] - trial.start)
    return math.inf
