"""Row about stops, with nodes: pressed at random instants of motions, while the controller works or hangs."""

from __future__ import annotations

import os
import random
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from flexarm_bringup.fault_drill.drive_time import COUNTED, driven_periods
from flexarm_bringup.fault_drill.findings import Finding
from flexarm_bringup.fault_drill.row import Row
from flexarm_bringup.fault_drill.system_stand import SystemStand, passes, stamp
from flexarm_controller.guarding.derive import GuardSettings

if TYPE_CHECKING:
    from flexarm_bringup.fault_drill.live_rig_node import LiveRig

STOPS = 40
PRESSED = (0.1, 0.6)  # s after a motion has begun, drawn evenly
HANGS = (0.005, 0.04)  # s for which a controller that hangs is silent already when the stop comes, likewise
STAYS = 0.5  # s that a stopped arm is watched for
WOKEN = 0.3  # s likewise, with a controller that goes on
AT_MOST, BEYOND_PERIOD = 0.05, 0.01  # s until nothing drives any more, at most and in 99 % beyond a period
REST = GuardSettings().rest_velocity  # rad/s or m/s


def stops(stand: SystemStand) -> list[Finding]:
    """Press stop again and again, every second time with a controller that hangs; count what passes after."""
    from flexarm_bringup.fault_drill.live_rig_node import live_rig

    rng = random.Random(stand.stand.seed)
    with live_rig(stand) as rig:
        done = [_stop(rig, rng.uniform(*PRESSED), k % 2 * rng.uniform(*HANGS)) for k in range(STOPS)]
    driven = [driven for _, driven in done]
    usual, bound = float(np.percentile(driven, 99.0)), stand.dt + BEYOND_PERIOD
    return [
        Finding(f"commands that passed after a stop, of {STOPS} stops", sum(late for late, _ in done), 0),
        Finding(f"last drive {COUNTED}, 99 %", usual, bound, "s"),
        Finding("last drive, at most", max(driven), AT_MOST, "s"),
    ]


def _stop(rig: LiveRig, after: float, hung: float) -> tuple[int, float]:
    """Move and stop; return how many commands passed afterwards, and for how long motors drove [s].

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
        rig.ear.call("guard/stop")
        told = rig.came["guard_status"]
        rig.wait(lambda: any(msg.mode != msg.ARMED for _, msg in told), "the stop")
        stopped = next(stamp(msg) for _, msg in told if msg.mode != msg.ARMED)
        rig.wait(lambda: told[-1][1].mode == told[-1][1].STOPPED, "rest")
        rig.listen(STAYS)
    rig.listen(WOKEN if hung else 0.0)
    passed = sum(passes(msg) for _, msg in told if stamp(msg) > stopped)
    return passed, _driven(rig, stopped)


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


def _driven(rig: LiveRig, since: float) -> float:
    """Return for how long motors put power into the arm after a stop [s]; what holds its weight counts."""
    told = [msg for _, msg in rig.came["drive_states"] if stamp(msg) >= since]
    theta_dot = np.array([msg.velocity for msg in told])
    power = (np.array([msg.effort for msg in told]) * theta_dot).sum(axis=1)
    last = driven_periods(power, theta_dot, REST)
    return stamp(told[last - 1]) - since + rig.stand.dt if last else 0.0


ROWS = (Row(53, "stop at random instants, half hung", "latched; no drive", stops, "N"),)
