"""Tools that open a ROS domain refuse, in one line and with code 2, where security cannot be had as asked."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from flexarm_bringup.cli import main
from flexarm_bringup.processes.composition import composed
from flexarm_bringup.processes.graph import rig_graph
from flexarm_bringup.processes.secured import check_graph_security
from flexarm_model.process.enclave_keys import FILES
from flexarm_model.process.security import SecurityError

ENFORCED = {"ROS_SECURITY_ENABLE": "true", "ROS_SECURITY_STRATEGY": "Enforce"}
TOOLS = (
    "rig --seconds 1", "echo", "echo modal_state --once", "monitor --once --wait 1", "monitor --seconds 1",
    "call", "call guard/arm", "arm", "stop", "goto 0.5 0.3",
)  # fmt: skip
ENCLAVES = {"rig": "watch", "echo": "tools", "monitor": "tools"}  # of the others: operator
OWN_DOMAINS = (
    "security {0}", "soak --minutes 0.01", "realtime --minutes 0.05", "faults single_link --rows 50",
    "demo --folder {0}", "demo planar_3rrr --folder {0}", "identify rig --nodes --manipulator single_link",
)  # fmt: skip
OFF = "or export ROS_SECURITY_ENABLE=false to run without security\n"


def refused(line: str, capsys: pytest.CaptureFixture[str]) -> str:
    """Run a command that has to refuse; return what it says."""
    assert main(line.split()) == 2
    said = capsys.readouterr()
    assert not said.out
    command = line.split()[0]
    assert said.err.startswith(f"flexarm {command}: ROS_SECURITY_") and said.err.count("\n") == 1
    return said.err


def ask(monkeypatch: pytest.MonkeyPatch, asked: dict[str, str]) -> None:
    """Ask for security in this process."""
    for name in ("ENABLE", "STRATEGY", "KEYSTORE", "ENCLAVE_OVERRIDE"):
        monkeypatch.delenv(f"ROS_SECURITY_{name}", raising=False)
    for name, value in asked.items():
        monkeypatch.setenv(name, value)


@pytest.mark.ros
@pytest.mark.unhurried
@pytest.mark.parametrize("line", TOOLS)
@pytest.mark.parametrize("strategy", [None, "Permissive", "enforce"])
def test_no_tool_runs_unsecured_when_security_is_asked_for(
    line: str, strategy: str | None, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    given = {"ROS_SECURITY_STRATEGY": strategy} if strategy else {}
    ask(monkeypatch, {"ROS_SECURITY_ENABLE": "true", **given})
    said = refused(line, capsys)
    assert f"ROS_SECURITY_STRATEGY: '{strategy or ''}': " in said and said.endswith(OFF)


@pytest.mark.ros
@pytest.mark.unhurried
@pytest.mark.parametrize("line", TOOLS)
def test_without_keys_a_tool_says_so_instead_of_a_traceback(
    line: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    ask(monkeypatch, ENFORCED)
    assert "ROS_SECURITY_KEYSTORE: '': no folder of keys" in refused(line, capsys)
    monkeypatch.setenv("ROS_SECURITY_KEYSTORE", str(tmp_path))
    enclave = f"/flexarm/{ENCLAVES.get(line.split()[0], 'operator')}"
    assert f"ros2 security create_enclave {tmp_path} {enclave}, then create_permission" in refused(
        line, capsys
    )


@pytest.mark.ros
@pytest.mark.unhurried
@pytest.mark.parametrize("line", TOOLS)
def test_without_libraries_a_tool_says_so_in_one_line_and_the_rig_starts_nothing(
    line: str, tmp_path: Path, ros_environment: dict[str, str]
) -> None:
    """Where there are libraries, folders without keys are refused all the same."""
    done = run(line, ros_environment | keystore(tmp_path))
    said = [text for text in done.stderr.splitlines() if not text.startswith("[INFO]")]
    assert (done.returncode, done.stdout) == (2, "") and len(said) == 1, done.stderr
    assert said[0].startswith(f"flexarm {line.split()[0]}: ") and "security" in said[0].lower()


@pytest.mark.ros
@pytest.mark.unhurried
@pytest.mark.parametrize("case", ["ENABLE alone", "no keys", "no libraries"])
def test_the_doctor_tells_it_as_one_fault_and_goes_on(
    case: str, tmp_path: Path, ros_environment: dict[str, str]
) -> None:
    asked = {"ENABLE alone": {"ROS_SECURITY_ENABLE": "true"}, "no keys": ENFORCED}.get(
        case, keystore(tmp_path)
    )
    done = run("doctor --json -", ros_environment | asked)
    found = json.loads(done.stdout)
    faults = [item for item in found if item["subject"] == "security" and item["verdict"] == "FAULT"]
    assert done.returncode == 1 and len(faults) == 1
    assert {"interpreter", "guard_node", "domain"} <= {item["subject"] for item in found}
    assert "graph" not in {item["subject"] for item in found}
    assert "Traceback" not in done.stderr


@pytest.mark.ros
@pytest.mark.unhurried
@pytest.mark.parametrize("line", OWN_DOMAINS)
def test_what_runs_nodes_in_domains_of_its_own_refuses_before_it_begins(
    line: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    ask(monkeypatch, keystore(tmp_path))
    said = refused(line.format(tmp_path / "out"), capsys)
    assert "for which there are no keys; export ROS_SECURITY_ENABLE=false for it" in said


def test_a_graph_is_refused_by_the_first_node_without_keys(tmp_path: Path) -> None:
    environment = keystore(tmp_path)
    check_graph_security(rig_graph(), environment)
    with pytest.raises(SecurityError, match="/flexarm/recorder, then"):
        check_graph_security(rig_graph(bag="bag"), environment)
    shutil.rmtree(tmp_path / "enclaves" / "flexarm" / "watch")
    with pytest.raises(SecurityError, match="/flexarm/watch, then"):
        check_graph_security(rig_graph(), environment)
    with pytest.raises(
        SecurityError, match="estimator and controller in one process: no enclave is for both"
    ):
        check_graph_security(composed(rig_graph()), environment)
    check_graph_security(composed(rig_graph()), {})


def keystore(folder: Path) -> dict[str, str]:
    """Return what asks for security with keys, empty ones, of all that a rig starts."""
    for name in ("watch", "tools", "operator", *(row.name for row in rig_graph())):
        (enclave := folder / "enclaves" / "flexarm" / name).mkdir(parents=True)
        for file in FILES:
            (enclave / file).touch()
    return {**ENFORCED, "ROS_SECURITY_KEYSTORE": str(folder)}


def run(line: str, environment: dict[str, str]) -> subprocess.CompletedProcess[str]:
    """Run a command as a process of its own."""
    return subprocess.run(
        [sys.executable, "-m", "flexarm_bringup.cli", *line.split()],
        env={**os.environ, **environment}, capture_output=True, text=True, timeout=120.0, check=False,
    )  # fmt: skip
