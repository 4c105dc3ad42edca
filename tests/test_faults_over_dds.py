"""The rows of the fault matrix that concern nodes, over DDS, by the measures of the library level."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

pytest.importorskip("flexarm_interfaces", reason="needs ROS and flexarm_interfaces")
from live_estimator import LiveStand  # noqa: E402
from missed_bounds import marks_of  # noqa: E402
from running_graph import running  # noqa: E402

from flexarm_bringup.fault_drill.drill import ESTIMATOR_ROWS, stand_of  # noqa: E402
from flexarm_bringup.fault_drill.findings import Finding  # noqa: E402
from flexarm_bringup.fault_drill.frame_rows import LATE  # noqa: E402
from flexarm_bringup.fault_drill.nodes_stand import NodesStand  # noqa: E402
from flexarm_bringup.fault_drill.row import cases  # noqa: E402
from flexarm_bringup.graph import Process  # noqa: E402
from flexarm_bringup.sessions import free_domains  # noqa: E402

pytestmark = [pytest.mark.ros, pytest.mark.slow]

INJECTED_BY_THE_RIG = (1, 2, 3, 4, 5, 12)
SENT_AS_MESSAGES = (18, 19, 21, 22, 23)
MACHINES = ("single_link", "planar_3rrr")


@pytest.fixture(scope="module", params=MACHINES)
def nodes(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> NodesStand:
    return NodesStand(stand_of(request.param), tmp_path_factory.mktemp("nodes"), free_domains())


@pytest.fixture(params=MACHINES)
def live(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[LiveStand]:
    with LiveStand(stand_of(request.param), tmp_path) as stand:
        yield stand


def assert_kept(findings: Sequence[Finding]) -> None:
    missed = [f"{f.what}: {f.measured:.4g} {f.unit}, wanted {f.bound}" for f in findings if not f.passed]
    assert findings and not missed, "\n".join(missed)


def test_nodes_estimate_as_well_as_the_library(nodes: NodesStand) -> None:
    """The motion differs a little: the drives follow the estimate instead of their own encoders."""
    assert 0.5 < nodes.nominal.rms() / nodes.library.rms() < 2.0


@pytest.mark.parametrize("number", INJECTED_BY_THE_RIG)
def test_faults_that_the_rig_injects_keep_their_bounds(
    nodes: NodesStand, number: int, request: pytest.FixtureRequest
) -> None:
    for mark in marks_of(nodes.name, number):
        request.applymarker(mark)
    assert_kept(ESTIMATOR_ROWS[number].play(nodes))


def test_frames_that_the_rig_delays_keep_their_bounds(nodes: NodesStand) -> None:
    assert_kept(cases(*LATE)(nodes))


@pytest.mark.parametrize("number", SENT_AS_MESSAGES)
def test_bad_messages_and_clocks_keep_their_bounds(live: LiveStand, number: int) -> None:
    assert_kept(ESTIMATOR_ROWS[number].play(live))


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
