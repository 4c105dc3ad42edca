"""Row about the network: the guard and the drives are cut off from all that thinks, then joined again."""

from __future__ import annotations

import os
import time
from multiprocessing import get_context
from typing import TYPE_CHECKING

from flexarm_bringup.fault_drill.findings import Finding
from flexarm_bringup.fault_drill.partition import Partition, partition, why_not
from flexarm_bringup.fault_drill.row import Row
from flexarm_bringup.fault_drill.stand import Skipped, Stand
from flexarm_bringup.fault_drill.system_stand import PATIENCE, SystemStand, passes, stamp
from flexarm_bringup.installed import find_executable
from flexarm_bringup.processes.graph import Process, ros_arguments

if TYPE_CHECKING:
    from flexarm_bringup.processes.running_graph_node import Ear

BESIDE_THE_MOTORS = ("guard", "rig")  # what stays together when the cable is pulled
TOPICS = ("guard_status", "joint_commands", "modal_state")
CUTS = (0.5, 3.0)  # s
SILENCE = 0.05  # s without a command that stop the arm
BACK = 2.0  # s after the cable is plugged in
WATCHED = 1.0  # s in which the guard must not arm itself


def cuts(stand: SystemStand) -> list[Finding]:
    """Pull the cable for a short and a long time while the arm is under control.

    In a process of its own: how far one discovers others stays as it was when it first spoke DDS.
    """
    reason = why_not()
    if reason:
        raise Skipped(reason)
    with get_context("spawn").Pool(1) as pool:
        return pool.apply(_cuts, (stand.name,))


def _cuts(machine: str) -> list[Finding]:
    from flexarm_bringup.processes.running_graph_node import running

    stand = SystemStand(Stand(machine))
    with partition(os.getpid() % 256) as net:

        def command(process: Process) -> list[str]:
            """Return the command line; inside the other network but beside the motors."""
            path = find_executable(process.package, process.executable, os.environ)
            line = [str(path), *ros_arguments(process)]
            return line if process.name in BESIDE_THE_MOTORS else net.inside(line)

        across = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}
        with running(stand.graph(), TOPICS, stand.folder(), across, command) as (_, ear):
            ear.wait_ready("rig", "guard", "estimator", "controller")
            return [finding for length in CUTS for finding in _cut(stand, net, ear, length)]


def _cut(stand: SystemStand, net: Partition, ear: Ear, length: float) -> list[Finding]:
    stand.arm(ear)
    told, commands = ear.heard["guard_status"], ear.heard["joint_commands"]
    net.cut()
    ear.listen(length)
    stops = [stamp(msg) for msg in told if msg.mode != msg.ARMED]
    sent = [stamp(msg) for msg in commands if stops and stamp(msg) <= stops[0]]
    silent = round(stops[0] - max(sent), 6) if sent else float("inf")  # stamps as floats: to 0.3 us
    ear.heard["modal_state"].clear()
    net.mend()
    mended = time.monotonic()
    ear.wait(lambda: bool(ear.heard["modal_state"]), PATIENCE, "the link")
    back = time.monotonic() - mended
    told.clear()
    ear.listen(WATCHED)
    name = f"cut for {length:g} s"
    return [
        Finding(f"{name}: braking after the stamp of the last command", silent, SILENCE + stand.dt, "s"),
        Finding(f"{name}: heard again after", back, BACK, "s"),
        Finding(f"{name}: commands that passed before it was armed", sum(map(passes, told)), 0),
    ]


ROWS = (Row(46, "network cut in two", "the guard stops; nothing moves by itself", cuts, "R"),)
