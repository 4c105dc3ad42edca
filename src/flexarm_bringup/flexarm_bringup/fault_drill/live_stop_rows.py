"""Row about stops, with nodes: pressed at random instants of motions, while the controller works or hangs."""

from __future__ import annotations

import math
import os
import random
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flexarm_bringup.fault_drill.drive_time import driven_periods, until_braked, until_undriven
from flexarm_bringup.fault_drill.findings import Finding
from flexarm_bringup.fault_drill.row import Row
from flexarm_bringup.fault_drill.system_stand import SystemStand, passes, stamp
from flexarm_controller.guarding.settings import GuardSettings

if TYPE_CHECKING:
    from flexarm_bringup.fault_drill.live_rig_node import LiveRig

STOPS, PRESSES = 40, 120  # wanted, and pressed at most
BUTTON = "stopped by ~/stop"  # the guard's reason
PRESSED = (0.1, 0.6)  # s after a motion has begun, drawn evenly
HANGS = (0.005, 0.04)  # s for which a controller that hangs is silent already when the stop comes, likewise
STAYS = 0.5  # s that a stopped arm is watched for
WOKEN = 0.3  # s likewise, with a controller that goes on
REST = GuardSettings().rest_velocity  # rad/s or m/s


def stops(stand: SystemStand) -> list[Finding]:
    """Press stop again and again, every second time with a controller that hangs; count what passes after."""
    from flexarm_bringup.fault_drill.live_rig_node import live_rig

    rng = random.Random(stand.stand.seed)
    with live_rig(stand) as rig:
        rig.ear.call("guard/stop")  # whoever presses a button has found its service already
        done: list[LiveStop] = []
        pressed = 0
        while len(done) < STOPS and pressed < PRESSES:
            stop = _stop(rig, rng.uniform(*PRESSED), len(done) % 2 * rng.uniform(*HANGS))
            done += [stop] if stop else []
            pressed += 1
    passed = sum(stop.passed for stop in done)
    return [
        Finding(f"stops by the button, pressed {pressed} times", len(done), STOPS, at_least=True),
        Finding(f"commands that passed after a stop, of {STOPS} stops", passed, 0),
        *until_braked(np.array([stop.braked for stop in done]), stand.dt),
        *until_undriven(np.array([stop.driven for stop in done])),
    ]


@dataclass(frozen=True)
class LiveStop:
    """One stop.

    Attributes:
        passed: Commands that the guard let through afterwards [1].
        braked: Time from when the button was pressed until a torque of the guard's own acted [s].
        driven: Time from the period that the guard stopped in until the motors drove the arm no more [s].
    """

    passed: int
    braked: float
    driven: float


def _stop(rig: LiveRig, after: float, hung: float) -> LiveStop | None:
    """Move and stop; None where the guard was quicker than the button: nobody waits for it then.

    Args:
        rig: The machine.
        after: Time from the begin of the motion [s].
        hung: Time for which the controller has hung [s]; 0: it works.
    """
    rig.arm()
    rig.swing()
    rig.listen(after)
    rig.forget()
    with _hanging(rig, hung):
        pressed = time.time()
        rig.ear.call("guard/stop")
        told = rig.came["guard_status"]
        rig.wait(lambda: any(msg.mode != msg.ARMED for _, msg in told), "the stop")
        stopped, reason = next((stamp(msg), msg.reason) for _, msg in told if msg.mode != msg.ARMED)
        rig.wait(lambda: told[-1][1].mode == told[-1][1].STOPPED, "rest")
        rig.listen(STAYS)
    rig.listen(WOKEN if hung else 0.0)
    if reason != BUTTON:
        return None
    passed = sum(passes(msg) for _, msg in told if stamp(msg) > stopped)
    return LiveStop(passed, _braked(rig, stopped) - pressed, _driven(rig, stopped))


@contextmanager
def _hanging(rig: LiveRig, hung: float) -> Iterator[None]:
    """Let the controller hang, for a while already; not for 0."""
    pid = rig.pid("controller")
    try:
        if hung:
            os.kill(pid, signal.SIGSTOP)
            rig.listen(hung)
        yield
    finally:
        if hung:
            os.kill(pid, signal.SIGCONT)


def _braked(rig: LiveRig, since: float) -> float:
    """Return when the drives began to act on a torque that the guard chose after it had stopped [s]."""
    asked = {tuple(msg.effort) for _, msg in rig.came["joint_commands"]}  # whatever the guard says of itself
    own = {tuple(msg.effort) for _, msg in rig.came["applied_effort"] if stamp(msg) >= since} - asked
    told = [msg for _, msg in rig.came["drive_states"] if stamp(msg) > since]
    acted = (stamp(msg) for msg in told if tuple(msg.effort) in own)
    return next(acted, math.inf) - rig.stand.dt  # a state tells of the period that ends with its stamp


def _driven(rig: LiveRig, since: float) -> float:
    """Return for how long motors put power into the arm after a stop [s]; what holds its weight counts."""
    told = [msg for _, msg in rig.came["drive_states"] if stamp(msg) >= since]
    theta_dot = np.array([msg.velocity for msg in told])
    power = (np.array([msg.effort for msg in told]) * theta_dot).sum(axis=1)
    last = driven_periods(power, theta_dot, REST)
    return stamp(told[last - 1]) - since + rig.stand.dt if last else 0.0


ROWS = (Row(53, "stop at random instants, half hung", "latched; braked", stops, "N"),)
