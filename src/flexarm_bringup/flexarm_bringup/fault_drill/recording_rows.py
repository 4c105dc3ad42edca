"""Row about recording: the disk is full in the middle of a run; the arm must not notice, the user must.

The disk is made full for the recorder alone: from one moment on its files may not grow (RLIMIT_FSIZE).
"""

from __future__ import annotations

import resource
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from flexarm_bringup.bags.bag_recovery import recover_bag
from flexarm_bringup.bags.bag_writer import DATA_FILE
from flexarm_bringup.fault_drill.findings import Finding
from flexarm_bringup.fault_drill.row import Row
from flexarm_bringup.fault_drill.system_stand import PATIENCE, SystemStand
from flexarm_bringup.processes.graph import Process

if TYPE_CHECKING:
    from flexarm_bringup.processes.running_graph_node import Ear

RECORDER, STATUS = "recorder", "flexarm/recorder"
TOPICS = ("guard_status", "/diagnostics")
WATCHED = 4.0  # s before, and as long after
RATIO, TOLD, SHARE = 1.2, 1.0, 0.9  # of the 99th percentile; s; of the messages
NODES = ("rig", "guard", "estimator", "controller")


def full_disk(stand: SystemStand) -> list[Finding]:
    """Let the recorder's disk fill while the arm is under control; then end it and recover its bag."""
    from flexarm_bringup.processes.running_graph_node import running

    folder = stand.folder()
    graph = stand.graph()
    with running((_recorder(graph[0], folder / "bag"), *graph), TOPICS, folder) as (supervisor, ear):
        ear.wait_ready(*NODES, RECORDER)
        stand.arm(ear)
        arrivals = _arrivals(ear)
        before = _p99(ear, arrivals)
        pid, size = supervisor.pids[RECORDER], (folder / "bag" / DATA_FILE).stat().st_size
        full, (_, hard) = time.monotonic(), resource.prlimit(pid, resource.RLIMIT_FSIZE)
        ear.heard["/diagnostics"].clear()
        resource.prlimit(pid, resource.RLIMIT_FSIZE, (size, hard))
        ear.wait(lambda: _error(ear) is not None, PATIENCE, "an error of the recorder")
        told = time.monotonic() - full
        after = _p99(ear, arrivals)
        said, died = _error(ear), RECORDER in supervisor.exit_codes()
        codes = supervisor.stop()
    written = sum(int(item.value) for item in said.values)
    recovered = sum(recover_bag(folder / "bag", folder / "recovered").bag.counts.values())
    return [
        Finding("99th percentile of the commands' intervals / before", after / before, RATIO),
        Finding("error on /diagnostics after", told, TOLD, "s"),
        Finding(f"messages recovered / the {written} taken", recovered / written, SHARE, at_least=True),
        Finding("recorder died of it", float(died), 0),
        Finding("exit code of the recorder in the end", float(codes[RECORDER]), 1, at_least=True),
    ]


def _recorder(row: Process, bag: Path) -> Process:
    """Return a recorder for the machine of another row of the graph."""
    shared = {key: row.parameters[key] for key in ("manipulator", "preset", "lockstep")}
    parameters = {**shared, "bag": str(bag)}
    return Process("flexarm_bringup", "recorder_node", RECORDER, parameters, essential=False, respawn=False)


def _arrivals(ear: Ear) -> list[float]:
    """Return a list that gets the time [s] at which every command arrives."""
    from flexarm_bringup.message_class import message_class
    from flexarm_bringup.processes.running_graph_node import DEEP_QOS

    arrivals: list[float] = []
    kind = message_class("flexarm_interfaces/msg/JointCommand")
    ear.node.create_subscription(
        kind, "joint_commands", lambda msg: arrivals.append(time.monotonic()), DEEP_QOS
    )
    return arrivals


def _p99(ear: Ear, arrivals: list[float]) -> float:
    """Listen for a while and return the 99th percentile of the intervals between commands [s]."""
    arrivals.clear()
    ear.listen(WATCHED)
    if len(arrivals) < 2:
        return float("inf")
    return float(np.percentile(np.diff(arrivals), 99))


def _error(ear: Ear) -> Any:
    """Return the recorder's status that says that nothing is written any more; None before."""
    for array in ear.heard["/diagnostics"]:
        for status in array.status:
            if status.name == STATUS and status.level == status.ERROR:
                return status
    return None


ROWS = (
    Row(
        52, "the disk fills while recording", "told at once, motion as before, bag recovered", full_disk, "N"
    ),
)
