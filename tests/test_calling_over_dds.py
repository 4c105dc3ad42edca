"""``flexarm arm``, ``stop``, ``goto`` and ``call``: a rig is commanded where there is no ros2 command."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from flexarm_interfaces.msg import GuardStatus, MotionStatus

from flexarm_bringup.cli import main
from flexarm_bringup.processes.graph import rig_graph
from flexarm_bringup.processes.running_graph_node import Ear, running

pytestmark = pytest.mark.ros

PATIENCE = 60.0  # s; others may use the cores
WAIT = ("--wait", f"{PATIENCE:g}")
LONG = ("--time", "60")  # s of simulated time, some of ours
AWAY = ("-0.32", "0.5543")  # m; as far from the axis as the tip is


def command(*arguments: str) -> subprocess.CompletedProcess[str]:
    line = [sys.executable, "-m", "flexarm_bringup.cli", *arguments]
    return subprocess.run(line, capture_output=True, text=True, timeout=3 * PATIENCE, check=False)


def goto(ear: Ear) -> subprocess.Popen[str]:
    """Begin a long motion in a process of its own, and return once that knows it to be under way."""
    line = [sys.executable, "-m", "flexarm_bringup.cli", "goto", *AWAY, *LONG, *WAIT]
    moving = subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert moving.stdout is not None
    said = re.match(r"goal (\d+) accepted, ", moving.stdout.readline())
    assert said, moving.communicate()
    under_way = (int(said[1]), MotionStatus.EXECUTING)

    def is_under_way() -> bool:
        assert moving.poll() is None, moving.communicate()
        return any((msg.goal_id, msg.state) == under_way for msg in ear.heard["motion_status"])

    ear.wait(is_under_way, PATIENCE, "a motion")
    return moving


def mode(ear: Ear) -> int:
    status = ear.latest("guard_status")
    return GuardStatus.STOPPED if status is None else int(status.mode)


def test_a_rig_is_armed_moved_cancelled_stopped_and_armed_again_by_commands(tmp_path: Path) -> None:
    topics = ("guard_status", "motion_status", "modal_state")
    with running(rig_graph(lockstep=True), topics, tmp_path) as (supervisor, ear):
        ear.wait_ready("model", "estimator", "controller", "guard", "rig")
        early = command("goto", "0.55", "0.32", *WAIT)
        assert early.returncode == 1 and "refused: " in early.stderr
        armed = command("arm", *WAIT)
        assert (armed.returncode, armed.stdout) == (0, "armed\n"), armed.stderr
        ear.wait(lambda: mode(ear) == GuardStatus.ARMED, PATIENCE, "the guard to be armed")
        ear.wait(lambda: len(ear.heard["modal_state"]) > 20, PATIENCE, "states")

        done = command("goto", "0.5543", "0.32", *WAIT)
        assert done.returncode == 0, done.stderr
        assert done.stdout.startswith("goal 1 accepted, ") and done.stdout.endswith("  there\n")
        refused = command("goto", "2", "0", *WAIT)
        assert refused.returncode == 1 and "out of reach" in refused.stderr

        moving = goto(ear)
        moving.send_signal(signal.SIGINT)
        said, wrong = moving.communicate(timeout=2 * PATIENCE)
        assert moving.returncode == 130 and said.endswith("coming to rest\n"), said + wrong
        ear.wait(lambda: ear.latest("motion_status").state == MotionStatus.CANCELED, PATIENCE, "the cancel")

        moving = goto(ear)
        stopped = command("stop", *WAIT)
        assert stopped.returncode == 0 and "stopped: stopped by " in stopped.stdout
        ear.wait(lambda: mode(ear) != GuardStatus.ARMED, PATIENCE, "the guard to stop")
        said, _ = moving.communicate(timeout=2 * PATIENCE)
        assert moving.returncode == 1 and "given up: " in said

        assert command("arm", *WAIT).returncode == 0  # again, after a stop
        ear.wait(lambda: mode(ear) == GuardStatus.ARMED, PATIENCE, "the guard to be armed")
        _assert_a_frozen_guard_is_stopped_when_it_goes_on(supervisor.pids["guard"])


def _assert_a_frozen_guard_is_stopped_when_it_goes_on(pid: int) -> None:
    """Who cannot be told is not taken for told, and is told as soon as it can be."""
    os.kill(pid, signal.SIGSTOP)
    try:
        nobody = command("stop", "--wait", "2")
        assert nobody.returncode == 2 and "NOBODY WAS TOLD" in nobody.stderr
        line = [sys.executable, "-m", "flexarm_bringup.cli", "stop", *WAIT]
        stopping = subprocess.Popen(line, stdout=subprocess.PIPE, text=True)
        with pytest.raises(subprocess.TimeoutExpired):
            stopping.communicate(timeout=3.0)
    finally:
        os.kill(pid, signal.SIGCONT)
    said, _ = stopping.communicate(timeout=2 * PATIENCE)
    assert stopping.returncode == 0 and "stopped: stopped by " in said


def test_services_are_listed_and_called_with_what_is_wrong_named(tmp_path: Path) -> None:
    with running(rig_graph(lockstep=True), ("guard_status",), tmp_path) as (_, ear):
        ear.wait_ready("model", "estimator", "controller", "guard", "rig")
        for wait in ("3", "10", "40"):  # all of it is waited: longer only where others use the cores
            listed = command("call", "--wait", wait).stdout
            if "/flexarm/estimator/set_noise" in listed and "/flexarm/guard/arm" in listed:
                break
        assert "/flexarm/guard/arm                         std_srvs/srv/Trigger\n" in listed
        assert "/flexarm/estimator/set_noise" in listed and "change_state" not in listed

        off = command("call", "estimator/toggle_sensor", "{name: camera, is_on: false}", *WAIT)
        assert off.returncode == 0 and yaml.safe_load(off.stdout)["success"] is True
        nobody = command("call", "/flexarm/estimator/toggle_sensor", "{name: ear}", *WAIT)
        answer = yaml.safe_load(nobody.stdout)
        assert nobody.returncode == 1 and not answer["success"] and "allowed: encoder" in answer["message"]
        idle = command("call", "controller/cancel", *WAIT)
        assert idle.returncode == 1 and yaml.safe_load(idle.stdout)["accepted"] is False
        field = command("call", "estimator/toggle_sensor", "{name: camera, on: false}", *WAIT)
        assert field.returncode == 2 and "must be text: write it in quotes" in field.stderr
        field = command("call", "estimator/toggle_sensor", "{sensor: camera}", *WAIT)
        assert field.returncode == 2 and "its fields: name (string), is_on (boolean)" in field.stderr
        life = command("call", "controller/change_state", "{transition: {label: deactivate}}", *WAIT)
        assert life.returncode == 0, life.stderr


@pytest.mark.parametrize(
    "line",
    ["stop --wait 1", "arm --wait 1", "goto 1 0 --wait 1", "call guard/arm --wait 1", "call --wait 1",
     "call --all --wait 1"],
)  # fmt: skip
def test_where_nobody_runs_nobody_is_told_and_the_command_says_so(
    line: str, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    domain_coordinator = pytest.importorskip("domain_coordinator", reason="needs ROS")
    with domain_coordinator.domain_id() as domain:
        monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
        assert main(line.split()) == 2
    told = capfd.readouterr().err.replace("offers /flexarm/guard/stop", "offers it")
    assert "nobody offers it" in told or "nobody offers any" in told


@pytest.mark.parametrize("line", ["call", "arm", "stop", "goto 1 0"])
def test_a_domain_that_is_none_is_refused(
    line: str, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "lab")
    assert main(line.split()) == 2
    assert "ROS_DOMAIN_ID: 'lab': expected a whole number, 0 to 232" in capfd.readouterr().err
