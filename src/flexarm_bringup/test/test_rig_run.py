"""``flexarm rig``: the graph starts, tells who is ready, and is gone soon after Ctrl-C."""

import contextlib
import os
import re
import resource
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from flexarm_bringup.cli import main

PATIENCE = 90.0  # s for what takes some; a graph that hangs shall not hang the tests
COMMAND = [sys.executable, "-m", "flexarm_bringup.cli", "rig"]


def test_an_arm_that_is_not_there_is_refused_by_name(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["rig", "single_lnk"]) == 2
    said = capsys.readouterr().err
    assert "manipulator: 'single_lnk'" in said and "planar_3rrr" in said


APART = {name: f"flexarm:{name}" for name in ("model", "estimator", "controller", "guard", "rig")}
TOGETHER = {
    "model": "flexarm:model", "composed": "flexarm:controller+estimator",
    "guard": "flexarm:guard", "rig": "flexarm:rig",
}  # fmt: skip


@pytest.mark.ros
@pytest.mark.parametrize(
    ("options", "titles", "crashed"),
    [((), APART, "model"), pytest.param(("--composed",), TOGETHER, "composed", marks=pytest.mark.long)],
)
def test_the_graph_becomes_ready_comes_back_after_a_crash_and_ends_with_its_command(
    options: tuple[str, ...],
    titles: dict[str, str],
    crashed: str,
    tmp_path: Path,
    ros_environment: dict[str, str],
) -> None:
    command = [*COMMAND, *options, "--log", str(tmp_path / "log")]
    process = subprocess.Popen(
        command, env=ros_environment, stdout=subprocess.PIPE, text=True, start_new_session=True
    )
    try:
        wait_for(process, "all ready")
        os.kill(child(process.pid, titles[crashed]), signal.SIGKILL)
        wait_for(process, f"{crashed} ended with -9, started again")
        wait_for(process, "all ready")
        second = subprocess.run(COMMAND, env=ros_environment, capture_output=True, text=True, check=False)
        assert second.returncode == 2 and "graph /flexarm runs already" in second.stderr
        assert "started" not in second.stdout  # nor has it told the guard of the first to stop
        nodes = children(process.pid)
        assert {name for _, name in nodes} == set(titles.values())
        took, others = end_by_interrupt(process)
        out, _ = process.communicate(timeout=60.0)
    finally:
        process.kill()
    assert process.returncode == 0
    assert out.splitlines()[-1].endswith("ended: " + ", ".join(f"{name} 0" for name in titles))
    assert not any(Path(f"/proc/{pid}").exists() for pid, _ in nodes)
    assert took <= 1.0 * max(1.0, os.getloadavg()[0], others)  # 1 s on an idle machine; others may use it


def end_by_interrupt(process: "subprocess.Popen[str]") -> tuple[float, float]:
    """Interrupt a process; return how long it took to end [s], and how many threads meanwhile shared a core.

    The average of the last minute knows nothing yet of who began to use the machine just now.
    """
    cores, waiting, started = len(os.sched_getaffinity(0)), [], time.monotonic()
    process.send_signal(signal.SIGINT)
    while process.poll() is None and time.monotonic() < started + 60.0:
        waiting.append(int(Path("/proc/loadavg").read_text().split()[3].partition("/")[0]))
        time.sleep(0.01)
    return time.monotonic() - started, sum(waiting) / max(1, len(waiting)) / cores


@pytest.mark.parametrize("domain", ["abc", "233", "-1", "1.5"])
def test_a_domain_that_is_none_is_refused_before_anything_is_started(
    domain: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", domain)
    assert main(["rig"]) == 2
    said = capsys.readouterr()
    assert said.err == f"flexarm rig: ROS_DOMAIN_ID: '{domain}': expected a whole number, 0 to 232\n"
    assert "started" not in said.out


@pytest.mark.ros
@pytest.mark.long
def test_a_service_manager_that_gives_no_home_gets_its_nodes(
    tmp_path: Path, ros_environment: dict[str, str]
) -> None:
    environment = {k: v for k, v in ros_environment.items() if k not in ("HOME", "ROS_LOG_DIR", "ROS_HOME")}
    command = [*COMMAND, "--log", str(tmp_path / "log")]
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) as process:
        try:
            wait_for(process, "all ready")
        finally:
            process.send_signal(signal.SIGINT)
        process.communicate(timeout=60.0)
    assert process.returncode == 0


@pytest.mark.ros
@pytest.mark.long
def test_who_reads_no_further_ends_it_in_order(tmp_path: Path, ros_environment: dict[str, str]) -> None:
    """Head, for one: the next line came from a callback, and was a traceback."""
    command = [*COMMAND, "--log", str(tmp_path / "log")]
    with subprocess.Popen(
        command, env=ros_environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None and process.stderr is not None
        try:
            wait_for(process, "model ready")
            nodes = titled_children(process.pid)
            process.stdout.close()
            told = process.stderr.read()
            process.wait(60.0)
        finally:
            process.kill()
    assert process.returncode == 141 and not told
    assert nodes and not any(Path(f"/proc/{pid}").exists() for pid, _ in nodes)


@pytest.mark.ros
@pytest.mark.long
def test_a_bag_whose_disk_is_full_is_told_at_once_and_the_end_is_1(
    tmp_path: Path, ros_environment: dict[str, str]
) -> None:
    command = [*COMMAND, "--log", str(tmp_path / "log"), "--bag", str(tmp_path / "bag")]
    with subprocess.Popen(command, env=ros_environment, stdout=subprocess.PIPE, text=True) as process:
        try:
            wait_for(process, "all ready")
            recorder = child(process.pid, "flexarm:recorder")
            _, hard = resource.prlimit(recorder, resource.RLIMIT_FSIZE)
            resource.prlimit(recorder, resource.RLIMIT_FSIZE, (1000, hard))
            wait_for(process, "recorder: recording ended: [Errno 27] File too large")
            resource.prlimit(recorder, resource.RLIMIT_FSIZE, (hard, hard))  # DDS keeps files of its own
        finally:
            process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=60.0)
    assert process.returncode == 1, out
    assert "recorder 1, model 0" in out  # nobody else ended of it
    assert f"to save what is: flexarm recover {tmp_path / 'bag'}" in out


@pytest.mark.ros
@pytest.mark.long
def test_who_is_impatient_at_the_start_leaves_nothing_behind(
    tmp_path: Path, ros_environment: dict[str, str]
) -> None:
    command = [*COMMAND, "--log", str(tmp_path / "log")]
    with subprocess.Popen(
        command, env=ros_environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as process:
        wait_for(process, "started; logs")
        for _ in range(3):
            process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=60.0)
    assert process.returncode == 0, out
    assert "ended: model" in out.splitlines()[-1] and "Traceback" not in out
    assert not still_running(ros_environment["ROS_DOMAIN_ID"])


def still_running(domain: str) -> list[str]:
    """Return the command lines of processes that were started in a ROS domain."""
    found = []
    for place in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):  # ended meanwhile, or somebody else's
            if f"ROS_DOMAIN_ID={domain}".encode() in (place / "environ").read_bytes().split(b"\0"):
                found.append((place / "cmdline").read_text())
    return found


def wait_for(process: "subprocess.Popen[str]", words: str) -> None:
    assert process.stdout is not None
    late = threading.Timer(PATIENCE, process.kill)
    late.start()
    try:
        for line in process.stdout:
            if words in line:
                return
    finally:
        late.cancel()
    raise AssertionError(f"ended, or was ended after {PATIENCE:g} s, before it said '{words}'")


def children(parent: int) -> list[tuple[int, str]]:
    """Return number and title of the nodes that a process has started."""
    listed = subprocess.run(
        ["ps", "-o", "pid,args", "--ppid", str(parent)], capture_output=True, text=True, check=False
    )
    found = re.findall(r"^ *(\d+) (flexarm:[\w+]+)$", listed.stdout, re.MULTILINE)
    return [(int(pid), name) for pid, name in found]


def titled_children(parent: int) -> list[tuple[int, str]]:
    """Return the same as soon as there is one: once, ps showed none of a graph that was ready."""
    end = time.monotonic() + PATIENCE
    while not (found := children(parent)) and time.monotonic() < end:
        time.sleep(0.1)
    return found


def child(parent: int, name: str) -> int:
    return next(pid for pid, title in children(parent) if title == name)
