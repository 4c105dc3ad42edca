"""Rows about processes: killed and frozen in a motion.

The graph runs by the clock and is watched as ``flexarm rig`` watches it. Times of torques and of the guard
are their stamps, which follow the clock; without the rig there are none, and times of arrival count. Evidence
that a fault was noticed is the first torque that the dead node has not asked for, or the guard's stop.
"""

from __future__ import annotations

import math
import os
import signal
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from flexarm_bringup.fault_drill.findings import Finding
from flexarm_bringup.fault_drill.row import Row
from flexarm_bringup.fault_drill.system_stand import SystemStand, passes, stamp

if TYPE_CHECKING:
    from flexarm_bringup.fault_drill.heard import Arrival
    from flexarm_bringup.fault_drill.live_rig_node import LiveRig

# what tells that a node is back; the torque that it decides or leads to, and who acts on it
STREAMS = {"model": "model", "estimator": "modal_state", "controller": "controller_status"}
STREAMS |= {"guard": "guard_status", "rig": "joint_states"}
DECIDES = {"guard": ("applied_effort", "drive_states")}
OF_A_COMMAND = ("joint_commands", "applied_effort")
NOTICED, SILENCE, BACK = 0.040, 0.050, 2.0  # s
UNDER_WAY = 0.3  # s of a swing until a process is hit
IN_FLIGHT = 0.2  # s in which messages of the dead node may still come, and in which no node starts
FADED = 0.05  # of the largest torque before
WATCHED = 1.0  # s after the hit, and again after everybody is back
FROZEN = 1.0  # s


def kills(stand: SystemStand) -> list[Finding]:
    """Kill every node in a motion, one after the other; all come back by themselves."""
    from flexarm_bringup.fault_drill.live_rig_node import live_rig

    with live_rig(stand) as rig:
        return [finding for name in STREAMS for finding in _killed(rig, name)]


def freezes(stand: SystemStand) -> list[Finding]:
    """Freeze every node in a motion for a second."""
    from flexarm_bringup.fault_drill.live_rig_node import live_rig

    with live_rig(stand) as rig:
        return [finding for name in STREAMS for finding in _frozen(rig, name)]


def _killed(rig: LiveRig, name: str) -> list[Finding]:
    rig.wait(lambda: rig.has_reserves, "reserves, as after some seconds of work")
    hit = strike(rig, name, signal.SIGKILL)
    rig.wait(lambda: name in rig.respawned, f"{name} to be started again")
    began = rig.respawned.pop(name)
    rig.wait(lambda: bool(news(rig, name, began)), f"{name} to be back")
    back = news(rig, name, began)[0][0] - hit
    rig.listen(WATCHED)
    return [
        *_stopped(rig, name, hit, "killed"),
        Finding(f"{name} killed: first message after", back, BACK, "s"),
        Finding(f"{name} killed: told that commands pass, not armed again", _passed(rig, name, hit), 0),
    ]


def news(rig: LiveRig, name: str, began: float) -> list[Arrival]:
    """Return what a node has said since it was started again; what is still in flight has older stamps."""
    since = began + IN_FLIGHT
    told = rig.after(STREAMS[name], since)
    return told if name == "model" else [arrival for arrival in told if stamp(arrival[1]) > since]


def _frozen(rig: LiveRig, name: str) -> list[Finding]:
    hit = strike(rig, name, signal.SIGSTOP)
    rig.listen(FROZEN)
    findings = _stopped(rig, name, hit, "frozen")
    woken = time.time()
    os.kill(rig.pid(name), signal.SIGCONT)
    rig.listen(WATCHED)
    told = rig.after("guard_status", hit - SILENCE)
    applied = passed_since(told, (hit + woken) / 2.0)
    if name == "model":  # nothing is due from it in a motion, and commands go on
        return [
            Finding("model frozen: the motion was stopped", float(_first_stop(rig, name, hit) < math.inf), 0)
        ]
    return [*findings, Finding(f"{name} frozen: old commands applied when it woke", applied, 0)]


def passed_since(told: Sequence[Arrival], frozen: float) -> float:
    """Return how many commands the guard let pass since it was frozen; infinity if it told nothing then.

    It is frozen at that instant: what it says of itself before, which may come only when it wakes, is what it
    had let pass by then.
    """
    before = [msg.passed for _, msg in told if stamp(msg) <= frozen]
    after = [msg.passed for _, msg in told if stamp(msg) > frozen]
    return after[-1] - [*after[:1], *before][-1] if after else math.inf


def strike(rig: LiveRig, name: str, number: int) -> float:
    """Arm, move, send a signal to a node; return when."""
    rig.arm()
    rig.swing()
    rig.listen(UNDER_WAY)
    rig.forget()
    rig.listen(SILENCE)
    os.kill(rig.pid(name), number)
    hit = time.time()
    rig.listen(SILENCE + 4 * NOTICED)
    return hit


def _stopped(rig: LiveRig, name: str, hit: float, what: str) -> list[Finding]:
    """Return how soon it was noticed and how soon the arm was being stopped."""
    told = rig.stand.dt if name == "guard" else 0.0  # drives tell of the period that ends with their stamp
    let_go = (_silent_drives(rig, hit) if name == "guard" else _first_stop(rig, name, hit)) - told - hit
    noticed = min(_own_torque(rig, name, hit) - told - hit, let_go)
    return [
        Finding(f"{name} {what}: noticed after", noticed, NOTICED, "s"),
        Finding(f"{name} {what}: stopping after", let_go, SILENCE + rig.stand.dt, "s"),
    ]


def _when(name: str, arrival: Arrival) -> float:
    """Return when something happened; see the module."""
    return arrival[0] if name == "rig" else stamp(arrival[1])


def _first_stop(rig: LiveRig, name: str, hit: float) -> float:
    """Return when the guard was first not armed after the hit; infinity if it always was."""
    stops = [_when(name, a) for a in rig.after("guard_status", hit) if a[1].mode != a[1].ARMED]
    return min(stops, default=math.inf)


def _own_torque(rig: LiveRig, name: str, hit: float) -> float:
    """Return the stamp of the first torque that the dead node has not asked for; infinity if none came."""
    ordered, acted = DECIDES.get(name, OF_A_COMMAND)
    asked = [stamp(msg) for _, msg in rig.came[ordered] if stamp(msg) <= hit + IN_FLIGHT]
    last = max(asked, default=hit)
    since = max(hit, last + 1.5 * rig.stand.dt)
    efforts = [(stamp(msg), tuple(msg.effort)) for _, msg in rig.came[acted] if stamp(msg) > since]
    changed = (at for (_, before), (at, now) in zip(efforts, efforts[1:], strict=False) if now != before)
    return next(changed, math.inf)


def _silent_drives(rig: LiveRig, hit: float) -> float:
    """Return the stamp of the first torque of the drives' own that is small or opposes the motion."""
    since = _own_torque(rig, "guard", hit)
    states = [
        (stamp(msg), np.array(msg.effort), np.array(msg.velocity)) for _, msg in rig.came["drive_states"]
    ]
    small = FADED * max((abs(effort).max() for at, effort, _ in states if at <= hit), default=0.0)
    rest = (
        at
        for at, effort, velocity in states
        if at >= since and ((effort * velocity <= 0.0) | (abs(effort) <= small)).all()
    )
    return next(rest, math.inf)


def _passed(rig: LiveRig, name: str, hit: float) -> int:
    told = rig.after("guard_status", hit)
    return sum(passes(a[1]) for a in told if _when(name, a) > hit + SILENCE + NOTICED)


ROWS = (
    Row(43, "a process is killed", "noticed, stopped, back; nothing moves before it is armed", kills, "N"),
    Row(44, "a process freezes for 1 s", "noticed, stopped; no old command is applied", freezes, "N"),
)
