"""Memory of every node of the graph, after it has run for a while over DDS in lockstep."""

from __future__ import annotations

import os
import tempfile
import time
from pathlib import Path

from flexarm_bringup.demo_run.sessions import free_domains
from flexarm_bringup.processes.graph import Process, rig_graph
from flexarm_bringup.processes.supervisor import Supervisor

PAGE_KB_PER_MB = 1024.0


def resident_mb(pid: int) -> float:
    """Return the resident memory of a process [MB]."""
    lines = Path(f"/proc/{pid}/status").read_text(encoding="ascii").splitlines()
    return float(next(line.split()[1] for line in lines if line.startswith("VmRSS:"))) / PAGE_KB_PER_MB


def main(seconds: float = 10.0) -> dict[str, float]:
    """Run the graph and return the resident memory of every node [MB]."""
    graph = tuple(rig_graph("single_link", "geared", lockstep=True))
    commander = Process("flexarm_bringup", "commander_node", "commander", {"lockstep": True}, essential=False)
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "ROS_DOMAIN_ID": str(next(free_domains()))}
        with Supervisor((*graph, commander), Path(folder), environment) as supervisor:
            time.sleep(seconds)
            failure = supervisor.failed()
            if failure:
                raise RuntimeError(failure)
            used = {name: resident_mb(pid) for name, pid in supervisor.pids.items() if name != "commander"}
    return {**{f"{name}_mb": value for name, value in used.items()}, "memory_largest_mb": max(used.values())}


if __name__ == "__main__":
    for name, value in main().items():
        print(f"{name:32} {value:12.1f}")
