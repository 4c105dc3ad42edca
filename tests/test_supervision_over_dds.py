"""Rows of the fault matrix about processes, over DDS: killed, frozen, restarted, doubled, without keys."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

pytest.importorskip("flexarm_interfaces", reason="needs ROS and flexarm_interfaces")
from domain_coordinator import domain_id  # noqa: E402

from flexarm_bringup.fault_drill import double_rows, live_restart_rows, process_rows  # noqa: E402
from flexarm_bringup.fault_drill.drill import stand_of  # noqa: E402
from flexarm_bringup.fault_drill.findings import Finding  # noqa: E402
from flexarm_bringup.fault_drill.system_stand import SystemStand  # noqa: E402
from flexarm_bringup.installed import find_executable  # noqa: E402
from flexarm_bringup.processes.graph import Process, rig_graph, with_drift, with_markers  # noqa: E402
from flexarm_model.process.enclave_keys import FILES  # noqa: E402

pytestmark = [pytest.mark.ros, pytest.mark.slow]
ROWS = {row.number: row for row in (*process_rows.ROWS, *live_restart_rows.ROWS, *double_rows.ROWS)}


def allowed(finding: Finding) -> float:
    """Return the bound; times may be longer on a machine that is busy with something else."""
    busy = max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1))
    return finding.limit * (busy if finding.unit == "s" else 1.0)


@pytest.mark.parametrize("number", ROWS)
def test_processes_fail_without_harm(number: int, tmp_path: Path) -> None:
    findings = ROWS[number].play(SystemStand(stand_of("single_link"), tmp_path))
    missed = [
        f"{f.what}: {f.measured:.4g} {f.unit}, wanted {f.bound}"
        for f in findings
        if not f.passed and (f.at_least or f.measured > allowed(f))
    ]
    assert findings and not missed, "\n".join(missed)


ENFORCED = {"ROS_SECURITY_ENABLE": "true", "ROS_SECURITY_STRATEGY": "Enforce"}
ASKED = {
    "ENABLE alone": {"ROS_SECURITY_ENABLE": "true"},
    "no keys": {**ENFORCED, "ROS_SECURITY_KEYSTORE": "empty"},
    "no libraries": {**ENFORCED, "ROS_SECURITY_KEYSTORE": "keys"},  # or keys that are none, where they are
}


@pytest.mark.parametrize("asked", ASKED)
@pytest.mark.parametrize("row", with_drift(with_markers(rig_graph(bag="bag"))), ids=lambda row: row.name)
def test_with_security_asked_for_and_not_to_be_had_a_node_does_not_run(
    row: Process, asked: str, tmp_path: Path
) -> None:
    package, executable = row.package, row.executable
    keys = tmp_path / "keys" / "enclaves" / "flexarm" / row.name
    for folder in (tmp_path / "empty", keys):
        folder.mkdir(parents=True)
    for name in FILES:
        (keys / name).touch()
    with domain_id() as domain:
        environment = {key: value for key, value in os.environ.items() if "BOOTSTRAP" not in key}
        environment |= {"ROS_DOMAIN_ID": str(domain), **ASKED[asked]}
        command = [str(find_executable(package, executable)), "--ros-args", "-p", f"bag:={tmp_path / 'bag'}"]
        done = subprocess.run(
            command[: 1 if executable != "recorder_node" else None],
            env=environment, cwd=tmp_path, capture_output=True, text=True, timeout=120.0, check=False,
        )  # fmt: skip
    assert done.returncode == 2
    said = [line for line in done.stderr.splitlines() if not line.startswith("[INFO]")]
    assert len(said) == 1 and "SECURITY" in said[0].upper(), done.stderr
    assert said[0].endswith("or export ROS_SECURITY_ENABLE=false to run without security")
