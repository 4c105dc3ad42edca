"""A reserve has loaded before it is needed, claims nothing until then, and never outlives who started it."""

import os
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import pytest
from test_supervisor import is_alive, until

from flexarm_bringup.processes.graph import Process
from flexarm_bringup.processes.reserves import TAKEN_WITHIN
from flexarm_bringup.processes.supervisor import Supervisor
from flexarm_model.process.single_instance import NameTakenError, claim_name

DOMAIN = "230"
START = (
    "import sys; from flexarm_model.process.executable import run_executable; "
    "sys.exit(run_executable('slow', ['left']))"
)
SLOW = """
import os, time
print("loaded", os.getpid(), flush=True)
def main():
    print("works", os.getpid(), os.environ.get("FLEXARM_RESERVE"), os.environ["FLEXARM_LIFE"], flush=True)
    time.sleep(300)
"""
ROW = Process("tests", "x", "left")


@pytest.fixture
def environment(tmp_path: Path) -> dict[str, str]:
    (tmp_path / "slow.py").write_text(SLOW)
    path = os.pathsep.join([str(tmp_path), *filter(None, sys.path)])
    return {**os.environ, "PYTHONPATH": path, "ROS_DOMAIN_ID": DOMAIN, "TMPDIR": str(tmp_path)}


def start(folder: Path, environment: dict[str, str], *rows: Process) -> Supervisor:
    return Supervisor(rows, folder / "log", environment, lambda row: [sys.executable, "-c", START])


def said(supervisor: Supervisor) -> list[list[str]]:
    return [line.split() for line in supervisor.log("left").read_text().splitlines()]


def test_a_reserve_that_has_loaded_takes_the_place_of_a_process_that_crashed(
    tmp_path: Path, environment: dict[str, str]
) -> None:
    with start(tmp_path, environment, ROW) as supervisor:
        until(lambda: ["works", str(supervisor.pids["left"]), "None"] in said(supervisor))  # first life: ""
        until(supervisor.provide)
        (loaded,) = (pid for what, pid, *_ in said(supervisor)[2:] if what == "loaded")
        folder = tmp_path / f"flexarm-{os.getuid()}"
        with pytest.raises(NameTakenError, match=str(supervisor.pids["left"])):  # its own, not the reserve's
            claim_name("/flexarm/left", DOMAIN, folder)
        os.kill(supervisor.pids["left"], signal.SIGKILL)
        until(lambda: bool(supervisor.exit_codes()))
        assert [ending.returns for ending in supervisor.tend()] == [True]
        assert supervisor.pids["left"] == int(loaded)
        until(lambda: ["works", loaded, "None", "1"] in said(supervisor))  # it hears at other ports
        assert len(said(supervisor)) == 4  # nothing was loaded again
        assert supervisor.stop()["left"] != 0
    assert not is_alive(int(loaded))


def test_a_reserve_that_hangs_is_ended_and_the_process_started_anew(
    tmp_path: Path, environment: dict[str, str]
) -> None:
    with start(tmp_path, environment, ROW) as supervisor:
        first = supervisor.pids["left"]
        until(lambda: ["works", str(first), "None"] in said(supervisor))
        until(supervisor.provide)
        (hanging,) = (int(pid) for what, pid, *_ in said(supervisor)[2:] if what == "loaded")
        os.kill(hanging, signal.SIGSTOP)
        os.kill(first, signal.SIGKILL)
        until(lambda: bool(supervisor.exit_codes()))
        started = time.monotonic()
        assert [ending.returns for ending in supervisor.tend()] == [True]
        busy = max(1.0, os.getloadavg()[0])  # starting a process takes some milliseconds, or more
        assert time.monotonic() - started < TAKEN_WITHIN + 1.0 * busy
        assert supervisor.pids["left"] not in (first, hanging)
        assert not is_alive(hanging)
        until(lambda: any(line[:2] == ["works", str(supervisor.pids["left"])] for line in said(supervisor)))


def test_a_process_comes_back_without_a_reserve_that_has_loaded(
    tmp_path: Path, environment: dict[str, str]
) -> None:
    (tmp_path / "slow.py").write_text("import time\ntime.sleep(300)\n")
    with start(tmp_path, environment, ROW) as supervisor:
        assert not supervisor.provide() and not supervisor.provide()
        first = supervisor.pids["left"]
        os.kill(first, signal.SIGKILL)
        until(lambda: bool(supervisor.exit_codes()))
        assert [ending.returns for ending in supervisor.tend()] == [True]
        assert supervisor.pids["left"] != first and not supervisor.exit_codes()


def test_those_without_whom_the_arm_moves_on_have_no_reserve(
    tmp_path: Path, environment: dict[str, str]
) -> None:
    rows = (Process("t", "x", "left", essential=False), Process("t", "x", "right", respawn=False))
    with start(tmp_path, environment, *rows) as supervisor:
        assert supervisor.provide()


def test_a_reserve_that_cannot_load_is_not_tried_again(tmp_path: Path, environment: dict[str, str]) -> None:
    with start(tmp_path, environment, ROW) as supervisor:
        until(lambda: "works" in supervisor.log("left").read_text())
        (tmp_path / "slow.py").write_text("import nowhere\n")
        until(supervisor.provide)
        count = supervisor.log("left").read_text().count("No module named 'nowhere'")
        assert count and supervisor.provide()
        assert supervisor.log("left").read_text().count("No module named 'nowhere'") == count


def test_reserves_end_with_the_supervisor_however_it_ends(
    tmp_path: Path, environment: dict[str, str]
) -> None:
    program = textwrap.dedent(f"""
        import sys, time
        from pathlib import Path
        from flexarm_bringup.processes.graph import Process
        from flexarm_bringup.processes.supervisor import Supervisor
        command = [sys.executable, "-c", {START!r}]
        row = Process("t", "x", "left")
        supervisor = Supervisor([row], Path({str(tmp_path)!r}), command=lambda row: command)
        while not supervisor.provide():
            time.sleep(0.01)
        print("there", flush=True)
        time.sleep(300)
    """)
    parent = subprocess.Popen(
        [sys.executable, "-c", program], env=environment, stdout=subprocess.PIPE, text=True
    )
    assert parent.stdout is not None and parent.stdout.readline() == "there\n"

    def pids() -> set[int]:
        return {int(line.split()[1]) for line in (tmp_path / "left.log").read_text().splitlines()}

    until(lambda: len(pids()) == 2)  # the reserve may have been the first to load
    os.kill(parent.pid, signal.SIGKILL)
    parent.wait()
    until(lambda: not any(map(is_alive, pids())))
