"""Gauges that fall silent in a move leave nobody to be blamed.

How the arm bends is hardly known without them, and what would follow from that must not count: some sensor
that is left out would seem to cure it.
"""

from __future__ import annotations

import pytest

from flexarm_bringup.fault_drill.stand import FAULT_END, FAULT_START, Stand
from flexarm_bringup.sim.sensor_faults import SensorFault

OFF = SensorFault("off", start=FAULT_START, end=FAULT_END)


@pytest.mark.parametrize("seed", [1, pytest.param(3, marks=pytest.mark.slow)])
@pytest.mark.parametrize("machine", ["single_link", pytest.param("planar_3rrr", marks=pytest.mark.slow)])
def test_no_sensor_is_called_faulty_in_or_after_an_outage_of_all_gauges(machine: str, seed: int) -> None:
    stand = Stand(machine, seed)
    gauges = [spec.name for spec in stand.sensors if spec.kind == "strain_gauge"]
    trace = stand.play(dict.fromkeys(gauges, OFF))
    reports = [report for estimate in trace.estimates for report in estimate.sensors]
    assert {report.status for report in reports if report.name in gauges} >= {"ok", "stale"}
    assert {(report.name, report.reason) for report in reports if report.status == "faulty"} == set()
