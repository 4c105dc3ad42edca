"""The rows of the fault matrix that concern nodes, over DDS, by the measures of the library level."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("flexarm_interfaces", reason="needs ROS and flexarm_interfaces")
from missed_bounds import judge  # noqa: E402

from flexarm_bringup.fault_drill.drill import FAMILIES, MACHINES, play_row, stand_of  # noqa: E402
from flexarm_bringup.processes.graph import Process  # noqa: E402
from flexarm_bringup.processes.running_graph_node import running  # noqa: E402

pytestmark = [pytest.mark.ros, pytest.mark.slow]


@pytest.mark.parametrize("machine", MACHINES)
def test_nodes_estimate_as_well_as_the_library(machine: str) -> None:
    """The motion differs a little: the drives follow the estimate instead of their own encoders."""
    nodes = stand_of(machine, "system").nodes
    assert 0.5 < nodes.nominal.rms() / nodes.library.rms() < 2.0


@pytest.mark.parametrize("machine", MACHINES)
@pytest.mark.parametrize("number", FAMILIES["system"].rows)
def test_rows_with_nodes_keep_their_bounds(machine: str, number: int) -> None:
    result = play_row(machine, "system", number)
    if result.skipped:
        pytest.skip(result.skipped)
    assert result.findings
    judge(machine, number, result.findings)


def test_the_rig_tells_which_faults_were_asked_for(tmp_path: Path) -> None:
    with running((rig_with("camera: delayed 30 ms; root_strain: off 1 3"),), ("/diagnostics",), tmp_path) as (
        _,
        ear,
    ):
        ear.wait(lambda: bool(ear.heard["/diagnostics"]), 40.0, "diagnostics")
        status = ear.latest("/diagnostics").status[0]
    assert (status.name, status.level) == ("rig: faults", b"\x01")
    assert status.message == "camera: delayed 0.0 delay 0.03 s; root_strain: off 1.0 3.0"


def test_the_rig_refuses_faults_that_it_does_not_understand(tmp_path: Path) -> None:
    with running((rig_with("elbow: off"),), (), tmp_path) as (supervisor, ear):
        ear.wait(lambda: "rig" in supervisor.exit_codes(), 40.0, "the rig to end")
        said = supervisor.log("rig").read_text(encoding="utf8")
    assert supervisor.exit_codes()["rig"] == 2
    assert "faults: 'elbow: off': must begin with one of encoder, root_strain" in said


def rig_with(faults: str) -> Process:
    return Process("flexarm_bringup", "rig_node", "rig", {"faults": faults})
