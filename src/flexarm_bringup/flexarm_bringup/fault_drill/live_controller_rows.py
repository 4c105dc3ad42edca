"""Rows about the controller, with nodes: it hangs for three periods, or its commands cannot be meant.

A process that is frozen for three periods is a solver that hangs for them, as far as anybody else can see.
Periods are told apart by stamps; the time between two commands is what the sender's middleware has noted.
"""

from __future__ import annotations

import math
import os
import signal
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.fault_drill.findings import ROUNDED, Finding
from flexarm_bringup.fault_drill.row import Row
from flexarm_bringup.fault_drill.system_stand import PATIENCE, SystemStand, stamp

if TYPE_CHECKING:
    from flexarm_bringup.fault_drill.live_rig_node import LiveRig
    from flexarm_bringup.processes.running_graph_node import Ear

Array = NDArray[np.float64]
HANGS, PERIODS = 20, 3
BITES = (
    0.5  # share of the hangs that leave a gap: others end just before a period does, or the rig left out one
)
STOPPED = 10  # periods without a command from which on the guard has stopped the arm, and nothing is due
BETWEEN = 0.15  # s from one to the next
SETTLE = 0.3  # s in which the last ones are told
TOLD = 1e-9  # of the torque limit: what is another torque
BESIDE = 0.01  # s beyond a period until a stop is told
OWN_FAULT = "command "  # how the guard's reason begins then
TRIES = 20  # until the guard sees one: of those that come in one period it looks at the newest
TOPICS = ("guard_status", "joint_commands", "applied_effort")

SPOILT: dict[str, Callable[[list[float]], list[float]]] = {
    "not a number": lambda effort: [math.nan, *effort[1:]],
    "infinite": lambda effort: [*effort[:-1], math.inf],
    "infinite, negative": lambda effort: [*effort[:-1], -math.inf],
    "one too many": lambda effort: [*effort, 0.0],
    "one too few": lambda effort: effort[1:],
    "none": lambda effort: [],
}


def acts(stand: SystemStand) -> list[Finding]:
    """Let the controller hang; look at the torque of the periods without a command."""
    from flexarm_bringup.fault_drill.live_rig_node import live_rig

    with live_rig(stand) as rig:
        _hang(rig)
        commands = [msg for _, msg in rig.came["joint_commands"]]
        torques = {_number(msg, stand.dt): np.array(msg.effort) for _, msg in rig.came["applied_effort"]}
    limit = np.array([axis.effort for axis in stand.stand.arm.config.actuated.values()])
    found = [_acts_after(gap, torques, TOLD * limit) for gap in _gaps(commands, stand.dt)]
    late = [after for after in found if after is not None]
    return [
        Finding(f"gaps of two periods and more, {HANGS} hangs", len(late), BITES * HANGS, at_least=True),
        Finding("guard acts after the last command / T", max(late, default=math.inf), 2.0),
    ]


def skips(stand: SystemStand) -> list[Finding]:
    """Let the controller hang; look at what it sends when it goes on, and what it counts."""
    from flexarm_bringup.fault_drill.live_rig_node import live_rig
    from flexarm_bringup.fault_drill.send_times_node import send_times

    with live_rig(stand) as rig, send_times("joint_commands") as sent:
        _hang(rig)
        told = [msg for _, msg in rig.came["controller_status"]]
    at, of = np.array([pair for pair in sent if stamp(told[0]) <= pair[1] <= stamp(told[-1])]).T
    without, counted = _missed(told, stand.dt)
    return [
        Finding(f"periods without a command, {HANGS} hangs", without, HANGS, at_least=True),
        Finding("of these, not counted by the controller", abs(without - counted), 0),
        Finding("smallest gap between two commands / T", np.diff(at).min() / stand.dt, 0.5, at_least=True),
        Finding("states answered twice, or after a newer one", int((np.diff(of) <= 0.0).sum()), 0),
    ]  # fmt: skip


def nonsense(stand: SystemStand) -> list[Finding]:
    """Send commands that cannot be meant, each as the one that follows next, until the guard has seen one."""
    from flexarm_bringup.fault_drill.forger_node import command_publisher
    from flexarm_bringup.processes.running_graph_node import running

    with running(stand.graph(), TOPICS, stand.folder()) as (_, ear):
        ear.wait_ready("rig", "guard", "estimator", "controller")
        publisher = command_publisher(ear)
        return [finding for what in SPOILT for finding in _one_spoilt(stand, ear, publisher, what)]


def _hang(rig: LiveRig) -> None:
    """Move the arm and freeze the controller again and again; an arm that is stopped is armed again."""
    rig.arm()
    rig.swing()
    rig.listen(BETWEEN)
    rig.forget()
    for _ in range(HANGS):
        pid = rig.pid("controller")
        os.kill(pid, signal.SIGSTOP)
        try:
            time.sleep(PERIODS * rig.stand.dt)
        finally:
            os.kill(pid, signal.SIGCONT)
        rig.listen(BETWEEN)
        told = rig.came["guard_status"]
        if told and told[-1][1].mode != told[-1][1].ARMED:
            rig.arm()
            rig.swing()
    rig.listen(SETTLE)


def _gaps(commands: Sequence[Any], period: float) -> list[range]:
    """Return the numbers of the periods from one command up to the next, where two or more are between."""
    meant = [round((msg.acts_at.sec + 1e-9 * msg.acts_at.nanosec) / period) for msg in commands]
    return [range(a, b) for a, b in zip(meant, meant[1:], strict=False) if b - a > 2]


def _missed(told: Sequence[Any], period: float) -> tuple[int, int]:
    """Return periods without a command and how many of them were counted, while the arm was not stopped."""
    told = [msg for msg in told if msg.mode != msg.INACTIVE]  # notices count nothing
    missed = [
        (_number(after, period) - _number(before, period) - 1, after.missed_cycles - before.missed_cycles)
        for before, after in zip(told, told[1:], strict=False)
    ]
    short = [pair for pair in missed if pair[0] < STOPPED]
    return sum(without for without, _ in short), sum(counted for _, counted in short)


def _number(msg: Any, period: float) -> int:
    """Return the number of the period that a message is about."""
    return round(stamp(msg) / period)


def _acts_after(gap: range, torques: dict[int, Any], least: Array) -> float | None:
    """Return after how many periods the torque is another than that of the last command.

    None: the rig left out a period itself, or the torque of one was not heard.
    """
    told = [torques.get(number) for number in gap]
    if any(torque is None for torque in told):
        return None
    heard = np.array(told)
    changed = (abs(heard[1:] - heard[0]) > least).any(axis=1).tolist()
    return float(1 + changed.index(True)) if any(changed) else math.inf


def _one_spoilt(stand: SystemStand, ear: Ear, publisher: Any, what: str) -> list[Finding]:
    """Send a command that cannot be meant while the arm is held, and look at what the motors got."""
    stand.arm(ear)
    told = ear.heard["guard_status"]
    ear.heard["applied_effort"].clear()
    after, reason = math.inf, "nothing"
    for _ in range(TRIES):
        msg = _next_command(stand, ear)
        msg.effort = SPOILT[what](list(msg.effort))
        known, sent = len(told), time.time()
        publisher.publish(msg)
        ear.listen(2.0 * stand.dt)
        stops = [status for status in told[known:] if status.mode != status.ARMED]
        if stops:
            after, reason = stamp(stops[0]) - sent, stops[0].reason
            ear.wait(lambda: told[-1].mode == told[-1].STOPPED, PATIENCE, "rest")
        if reason.startswith(OWN_FAULT):
            break
    return [
        Finding(f"{what}: stopping after", after, stand.dt + BESIDE, "s"),
        Finding(f"{what}: stopped by '{reason}'", not reason.startswith(OWN_FAULT), 0),
        Finding(f"{what}: torques not finite, beyond a limit or its rate", _unsafe(stand, ear), 0),
    ]


def _next_command(stand: SystemStand, ear: Ear) -> Any:
    """Return a command as the controller will send it next, when one has been heard just now."""
    from flexarm_bringup.fault_drill.forged import following

    axes, heard = len(stand.stand.arm.config.actuated), ear.heard["joint_commands"]
    heard.clear()

    def real() -> list[Any]:
        """Return those of the controller: what we send ourselves is heard, too."""
        return [msg for msg in heard if len(msg.effort) == axes and np.isfinite(msg.effort).all()]

    told = ear.heard["guard_status"]
    while not real():
        ear.wait(lambda: bool(real()) or told[-1].mode == told[-1].STOPPED, PATIENCE, "a command")
        if not real():  # nobody sends any: the machine stood still, and the guard has stopped
            stand.arm(ear)
    return following(real()[-1], round(1e9 * stand.dt))


def _unsafe(stand: SystemStand, ear: Ear) -> int:
    """Return how many torques that reached the motors were none."""
    axes = list(stand.stand.arm.config.actuated.values())
    most, rate = (
        ROUNDED * np.array([getattr(axis, key) for axis in axes]) for key in ("effort", "effort_rate")
    )
    applied = [(stamp(msg), np.array(msg.effort)) for msg in ear.heard["applied_effort"]]
    wrong = sum(tau.shape != most.shape or not (abs(tau) <= most).all() for _, tau in applied)
    if wrong:
        return wrong
    pairs = zip(applied, applied[1:], strict=False)
    return sum(bool((abs(now - before) > rate * (t - since)).any()) for (since, before), (t, now) in pairs)


ROWS = (
    Row(39, "the controller hangs for 3 T", "guard acts", acts, "N"),
    Row(40, "steps take 3 T", "missed cycles skipped and counted, no burst", skips, "N"),
    Row(41, "command not finite or of wrong length", "stopped; nothing of it at the motors", nonsense, "N"),
)  # fmt: skip
