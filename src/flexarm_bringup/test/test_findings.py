"""Findings of the fault drill: what is the fault's, and what is a bound that is just kept."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from flexarm_bringup.fault_drill.findings import Finding, Trial
from flexarm_bringup.fault_drill.recovery import recovered_within
from flexarm_bringup.fault_drill.stand import Trace

NOISE = "top_gyroscope: noise is 4 times what it should be"
START, END = 0.2, 0.4


def trace(*unwell: tuple[float, float, str]) -> Trace:
    """Return what was said in a second of 100 Hz: ok but from, to, for a reason."""
    t = np.arange(100) * 0.01
    said: list[Any] = [SimpleNamespace(status="ok", reason="") for _ in t]
    for first, last, reason in unwell:
        for k in np.flatnonzero((t >= first - 1e-9) & (t < last - 1e-9)):
            said[k] = SimpleNamespace(status="degraded", reason=reason)
    return Trace(t, np.zeros(t.size), np.zeros(t.size), tuple(said), {})


def again(sound: Trace, faulty: Trace) -> Finding:
    stand: Any = SimpleNamespace(nominal=sound)
    return recovered_within(0.2)(Trial(stand, faulty, ("strain",), START, END))


def test_a_sensor_that_is_back_is_timed_to_the_last_word_against_it() -> None:
    found = again(trace(), trace((0.23, 0.45, "strain: stale"), (0.5, 0.55, "strain: outlier")))
    assert found.measured == pytest.approx(0.15) and found.what == "ok again after"


def test_what_the_run_without_the_fault_is_blamed_for_is_none_of_the_fault_s() -> None:
    """An arm whose gyroscope was noisy in its moves missed every row of silent sensors by 1.855 s."""
    noisy = trace((0.7, 0.9, NOISE))
    found = again(noisy, trace((0.23, 0.45, "strain: stale"), (0.7, 0.9, NOISE)))
    assert found.measured == pytest.approx(0.05)
    assert found.what == "ok again after (without the fault it is not in 20% of the run)"
    found = again(noisy, trace((0.7, 0.8, f"{NOISE}; strain: stale")))
    assert found.measured == pytest.approx(0.4)
    found = again(noisy, trace((0.6, 0.9, NOISE)))  # sooner than without the fault
    assert found.measured == pytest.approx(0.3)


def test_a_bound_that_is_met_is_kept_whatever_rounding_makes_of_it() -> None:
    """Three frames and a latency were 0.04500000000000037 s, and missed."""
    assert Finding("stale after", 0.04500000000000037, 0.045, "s").passed
    assert not Finding("stale after", 0.0451, 0.045, "s").passed
    assert Finding("share", 0.3 - 1e-16, 0.3, at_least=True).passed
    assert not Finding("share", 0.2999, 0.3, at_least=True).passed
    assert Finding("count", 0, 0).passed and not Finding("count", 1, 0).passed
