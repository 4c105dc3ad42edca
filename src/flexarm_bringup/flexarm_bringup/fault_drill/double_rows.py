"""Row about a node that is started twice: the second one ends, and the first one does not notice."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from flexarm_bringup.fault_drill.findings import Finding
from flexarm_bringup.fault_drill.row import Row
from flexarm_bringup.fault_drill.system_stand import SystemStand
from flexarm_bringup.processes.graph import Process
from flexarm_bringup.processes.supervisor import Supervisor

if TYPE_CHECKING:
    from flexarm_bringup.fault_drill.live_rig_node import LiveRig

SOON = 3.0  # s until a second node of a name has ended
PATIENCE = 60.0  # s
TAKEN = 3  # its exit code


def doubles(stand: SystemStand) -> list[Finding]:
    """Start every node a second time while the arm is under control."""
    from flexarm_bringup.fault_drill.live_rig_node import live_rig

    with live_rig(stand) as rig:
        rig.arm()
        rig.forget()
        findings = [finding for row in stand.graph() for finding in _doubled(rig, row)]
        rig.listen(SOON)
        stopped = sum(msg.mode != msg.ARMED for _, msg in rig.came["guard_status"])
        return [*findings, Finding("the guard noticed one of them", stopped, 0)]


def _doubled(rig: LiveRig, row: Process) -> list[Finding]:
    """Start a second node of a name and wait for its end."""
    started = time.monotonic()
    with Supervisor((row,), rig.stand.folder()) as second:
        while not second.exit_codes() and time.monotonic() - started < PATIENCE:
            rig.listen(0.01)
        took = time.monotonic() - started
        refused = second.exit_codes().get(row.name) == TAKEN
    return [
        Finding(f"second {row.name}: refused", float(refused), 1.0, at_least=True),
        Finding(f"second {row.name}: ended after", took, SOON, "s"),
    ]


ROWS = (Row(54, "a node is started twice", "the second one ends at once, unnoticed", doubles, "N"),)
