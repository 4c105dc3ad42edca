"""Row about floods: somebody speaks as fast as he can, or says ten megabytes, where the nodes listen.

The guard itself measures its cycle and tells it on /diagnostics once a second, so that no ear counts; the
figures of a flood stand beside those of the seconds before it, of the same run. What the flood may cost is
time and memory; where the commands stay out for longer than the guard bears, the arm must have been stopped.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING

from flexarm_bringup.fault_drill.findings import Finding
from flexarm_bringup.fault_drill.row import Row
from flexarm_bringup.fault_drill.system_stand import PATIENCE, SystemStand
from flexarm_bringup.soak.memory import resident_mb

if TYPE_CHECKING:
    from flexarm_bringup.processes.running_graph_node import Ear
    from flexarm_bringup.processes.supervisor import Supervisor

FLOODS = ("sensor", "command", "parameter", "large sensor", "large command")
TOPICS = ("guard_status", "/diagnostics")
NODES = ("rig", "guard", "estimator", "controller")
LOOP = "guard: loop"
P99, LONGEST = "period, 99th percentile [ms]", "period, longest [ms]"
WATCHED = 5.0  # s before a flood, and as long in it
SLACK = 1.2  # s of the flood that are not watched: the figures of its first second are of before, too
STEP = 0.1  # s between two looks at the memory
RATIO, GAP, MEMORY = 2.0, 50.0, 20.0  # 1, ms, MB


@dataclass(frozen=True)
class Watched:
    """Some seconds: cycle of the guard [ms], memory by process [MB], whether the arm was stopped."""

    p99: float
    longest: float
    memory: dict[str, float]
    is_stopped: bool


def floods(stand: SystemStand) -> list[Finding]:
    """Flood one topic after the other while the arm is held."""
    from flexarm_bringup.processes.running_graph_node import running

    found: list[Finding] = []
    with running(stand.graph(), TOPICS, stand.folder()) as (supervisor, ear):
        ear.wait_ready(*NODES)
        for kind in FLOODS:
            stand.arm(ear)
            found += _flood(kind, supervisor, ear)
    return found


def _flood(kind: str, supervisor: Supervisor, ear: Ear) -> list[Finding]:
    before = _watch(supervisor, ear)
    line = [sys.executable, "-m", "flexarm_bringup.fault_drill.flooder_node", kind, str(2 * SLACK + WATCHED)]
    with subprocess.Popen(line, env=supervisor.environment, stdout=subprocess.PIPE, text=True) as flooder:
        assert flooder.stdout is not None  # for the types: it was asked for
        flooder.stdout.readline()
        ear.listen(SLACK)
        during = _watch(supervisor, ear)
        ear.wait(lambda: flooder.poll() is not None, PATIENCE, "the flood to end")
        said = flooder.stdout.readline().strip()
    ear.listen(1.0)  # what it has started ends
    grown = {name: during.memory[name] - before.memory[name] for name in before.memory}
    most = max(grown, key=lambda name: grown[name])
    unsafe = float(during.longest > GAP and not during.is_stopped)
    return [
        Finding(
            f"{kind}, {said}: 99th percentile of the guard's cycle / before", during.p99 / before.p99, RATIO
        ),
        Finding(f"{kind}: gap above {GAP:g} ms without a stop", unsafe, 0),
        Finding(f"{kind}: memory, {most} the most", grown[most], MEMORY, "MB"),
    ]


def _watch(supervisor: Supervisor, ear: Ear) -> Watched:
    """Watch the guard for some seconds, at least one of its verdicts long."""
    for heard in ear.heard.values():
        heard.clear()
    memory: dict[str, float] = {}
    for _ in range(round(WATCHED / STEP)):
        ear.listen(STEP)
        for name, pid in supervisor.pids.items():
            memory[name] = max(memory.get(name, 0.0), resident_mb(pid) or 0.0)
    ear.wait(lambda: bool(_figures(ear, P99)), PATIENCE, f"a verdict on '{LOOP}'")
    stopped = any(msg.mode != msg.ARMED for msg in ear.heard["guard_status"])
    return Watched(statistics.median(_figures(ear, P99)), max(_figures(ear, LONGEST)), memory, stopped)


def _figures(ear: Ear, name: str) -> list[float]:
    """Return a figure of the guard's loop, of every second that was heard of."""
    return [
        float(pair.value)
        for array in ear.heard["/diagnostics"]
        for status in array.status
        if status.name == LOOP
        for pair in status.values
        if pair.key == name
    ]


ROWS = (
    Row(51, "floods on topics; messages of 10 MB", "cycle and memory as before, or a safe stop", floods, "N"),
)
