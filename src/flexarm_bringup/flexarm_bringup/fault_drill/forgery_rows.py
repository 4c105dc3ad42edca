"""Rows about commands that nobody of us has sent, and about security that is asked for but not there."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from typing import TYPE_CHECKING, Any

from flexarm_bringup.fault_drill.findings import Finding
from flexarm_bringup.fault_drill.partition import partition, why_not
from flexarm_bringup.fault_drill.row import Row
from flexarm_bringup.fault_drill.stand import Skipped
from flexarm_bringup.fault_drill.system_stand import PATIENCE, SystemStand
from flexarm_bringup.processes.supervisor import Supervisor

if TYPE_CHECKING:
    from flexarm_bringup.processes.running_graph_node import Ear

TOPICS = ("guard_status", "joint_commands", "applied_effort")
FORGED = 1000  # commands
FROM_OUTSIDE = 200
SHARE = 0.37  # of the torque limit: a torque that nobody asks for at rest
ALARM = 3.0  # s until it is told
OLD = 40  # commands that are kept to be sent again
ENDED = 3.0  # s
START = 20.0  # s; a node takes a second or two to start
SECURED = {"ROS_SECURITY_ENABLE": "true", "ROS_SECURITY_STRATEGY": "Enforce"}


def forgeries(stand: SystemStand) -> list[Finding]:
    """Send commands with guessed tokens and used sequences, and real ones twice, while the arm is held."""
    from flexarm_bringup.fault_drill.forger_node import PACE, Forger
    from flexarm_bringup.processes.running_graph_node import running

    with running(stand.graph(), TOPICS, stand.folder()) as (_, ear):
        _hold(stand, ear)
        forger = Forger(ear.node, _effort(stand))
        ear.wait(lambda: forger.listeners > 0, PATIENCE, "the guard to be found")
        ways = (forger.forge, forger.outdate, forger.repeat)
        before, started, alarm = ear.latest("guard_status").refused, time.monotonic(), float("inf")
        for number in range(FORGED):
            ways[number % len(ways)](ear.heard["joint_commands"][-OLD])
            ear.listen(PACE)
            if ear.latest("guard_status").refused > before:
                alarm = min(alarm, time.monotonic() - started)
        ear.listen(0.5)
        stopped = sum(msg.mode != msg.ARMED for msg in ear.heard["guard_status"])
        return [
            Finding(f"applied of {FORGED} forged and repeated commands", _applied(stand, ear), 0),
            Finding("refusals told after", alarm, ALARM, "s"),
            Finding("the arm was stopped by them", stopped, 0),
        ]


def from_another_host(stand: SystemStand) -> list[Finding]:
    """Send forged commands from another host while the rig speaks on its own machine only."""
    reason = why_not()
    if reason:
        raise Skipped(reason)
    from flexarm_bringup.processes.running_graph_node import running

    forger = [sys.executable, "-m", "flexarm_bringup.fault_drill.forger_node", str(FROM_OUTSIDE)]
    with partition(os.getpid() % 256) as net, running(stand.graph(), TOPICS, stand.folder()) as (_, ear):
        _hold(stand, ear)
        outside = {**os.environ, "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}
        line = net.inside([*forger, *map(repr, _effort(stand))])
        with subprocess.Popen(line, env=outside, stdout=subprocess.PIPE, text=True) as sent:
            ear.wait(lambda: sent.poll() is not None, 2 * PATIENCE, "the other host")
            said = sent.communicate()[0]
        heard = sum(list(msg.effort) == _effort(stand) for msg in ear.heard["joint_commands"])
        return [
            Finding(f"from another host: it found '{said.strip()}', heard of {FROM_OUTSIDE}", heard, 0),
            Finding("from another host: applied", _applied(stand, ear), 0),
        ]


def replays(stand: SystemStand) -> list[Finding]:
    """Send the commands of a session again in the next one; ask for security that is not installed."""
    from flexarm_bringup.fault_drill.forger_node import PACE, Forger
    from flexarm_bringup.processes.running_graph_node import running

    with running(stand.graph(), TOPICS, stand.folder()) as (_, ear):
        _hold(stand, ear)
        old = list(ear.heard["joint_commands"])
        forger = Forger(ear.node, _effort(stand))
        ear.wait(lambda: forger.listeners > 0, PATIENCE, "the guard to be found")
        ear.call("guard/stop")
        told = ear.heard["guard_status"]
        ear.wait(lambda: told[-1].mode == told[-1].STOPPED, PATIENCE, "rest")
        passed = told[-1].passed
        for msg in old:
            forger.repeat(msg)
            ear.listen(PACE)
        ear.listen(0.5)
        late = [Finding("commands of an old session applied", told[-1].passed - passed, 0)]
    return late + _without_libraries(stand)


def _without_libraries(stand: SystemStand) -> list[Finding]:
    environment = {**os.environ, **SECURED, "ROS_SECURITY_KEYSTORE": str(stand.folder())}
    with Supervisor(stand.graph(), stand.folder(), environment) as supervisor:
        ended = supervisor.wait(START)
        codes = supervisor.exit_codes()
    good = [name for name, code in codes.items() if code == 0]
    running_on = 0 if ended else len(stand.graph()) - len(codes)
    return [
        Finding("nodes that run without the security they were asked for", len(good) + running_on, 0),
    ]


def _hold(stand: SystemStand, ear: Ear) -> None:
    ear.wait_ready("rig", "guard", "estimator", "controller")
    stand.arm(ear)
    ear.wait(lambda: len(ear.heard["joint_commands"]) > OLD, PATIENCE, "commands")


def _effort(stand: SystemStand) -> list[float]:
    return [SHARE * axis.effort for axis in stand.stand.arm.config.actuated.values()]


def _applied(stand: SystemStand, ear: Ear) -> int:
    """Return how many torques that were let through come near what was forged."""
    forged = _effort(stand)
    heard: list[Any] = ear.heard["applied_effort"]
    return sum(all(x > 0.5 * y for x, y in zip(msg.effort, forged, strict=True)) for msg in heard)


def _forged_everywhere(stand: SystemStand) -> list[Finding]:
    found = forgeries(stand)
    try:
        return found + from_another_host(stand)
    except Skipped:  # the row stands without its part that needs root
        return found


ROWS = (
    Row(49, "unauthorised publisher of commands", "none applied; refusals are told", _forged_everywhere, "N"),
    Row(50, "old commands; security without libraries", "refused; nodes do not run", replays, "N"),
)
