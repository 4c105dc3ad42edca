"""How soon after a fault all is well again, and what of the bad news is the fault's."""

from __future__ import annotations

import math

import numpy as np

from flexarm_bringup.fault_drill.findings import Finding, Measure, Trial


def recovered_within(seconds: float) -> Measure:
    """Measure the time from the end of the fault until the estimate is "ok" and stays so.

    What the run without the fault is blamed for as well is none of the fault's.
    """

    def measure(trial: Trial) -> Finding:
        """Measure from the end of the fault on."""
        trace, sound = trial.trace, [e.status == "ok" for e in trial.stand.nominal.estimates]
        first = trace.tick(trial.end)
        bad = [k for k in range(first, len(trace.t)) if _is_worse(trial, k)]
        back = bad[-1] + 1 if bad else first
        since = trace.t[back] - trial.end if back < len(trace.t) else math.inf
        unsound = (
            "" if all(sound) else f" (without the fault it is not in {1 - np.mean(sound):.0%} of the run)"
        )
        return Finding(trial.name(f"ok again after{unsound}"), float(since), seconds, "s")

    return measure


def _is_worse(trial: Trial, k: int) -> bool:
    """Return whether an estimate is not "ok" by the fault: it names a sensor at fault, or was ok without."""
    estimate, sound = trial.trace.estimates[k], trial.stand.nominal
    if estimate.status == "ok":
        return False
    same = sound.estimates[min(sound.tick(trial.trace.t[k]), len(sound.t) - 1)]
    return same.status == "ok" or any(name in estimate.reason for name in trial.sensors)
