"""Gauges whose bridge is not zeroed: the shipped descriptions learn it, and the tip stays where it is known.

The whole tour is done with every gauge off, in turn up and down: by 20 ustrain, on the strip by 2, for there
20 are so many of its sigmas that the gauge is put out of use. e0 is the tip's RMS error
without that, from one second on.
"""

from __future__ import annotations

from dataclasses import replace

import pytest

from flexarm_bringup.fault_drill.stand import Stand, Trace
from flexarm_bringup.sim.sensor_faults import SensorFault
from flexarm_estimator.estimator import Estimator

SETTLED = 1.0  # s
GAUGE = "strain_gauge"


def rms(trace: Trace) -> float:
    """Return the RMS tip error once the zeros are learned [m]."""
    return trace.rms(SETTLED, float(trace.t[-1]))


@pytest.mark.parametrize(
    ("name", "zero", "worth"),
    [
        ("single_link", 2e-6, 3.0),
        pytest.param("spatial_3tpt", 20e-6, 2.0, marks=pytest.mark.slow),
        pytest.param("serial_6r", 20e-6, 10.0, marks=pytest.mark.slow),
    ],
)
def test_bridges_that_are_not_zeroed_do_not_move_the_tip(name: str, zero: float, worth: float) -> None:
    """Without biases nobody is accused of it either, or somebody else."""
    stand = Stand(name)
    gauges = [spec.name for spec in stand.of_kind(GAUGE)]
    off = {gauge: SensorFault("bias", 0.0, bias=zero * (-1) ** i) for i, gauge in enumerate(gauges)}
    trace, e0 = stand.play(off), rms(stand.nominal)
    reports = [report for estimate in trace.estimates for report in estimate.sensors]
    known = Estimator(
        stand.record.model,
        stand.arm.tree,
        tuple(replace(spec, bias=None) if spec.kind == GAUGE else spec for spec in stand.sensors),
        stand.settings,
    )
    without = rms(stand.play(off, estimator=known))
    print(f"\n{name}: {1e6 * e0:.1f} um; zeros off {rms(trace) / e0:.2f} e0, no biases {without / e0:.1f} e0")
    assert {(report.name, report.reason) for report in reports if report.status == "faulty"} == set()
    assert rms(trace) <= 1.1 * e0
    assert without > worth * e0
