"""Rows about sensors and clocks, with nodes: what goes wrong in a motion must end it.

The graph runs by the clock under the law of the machine, and the rig is told what goes wrong. The estimator's
part of these rows, with all its bounds, is played beside (``nodes_rows``).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from flexarm_bringup.fault_drill.findings import Finding
from flexarm_bringup.fault_drill.process_rows import SILENCE, UNDER_WAY, WATCHED
from flexarm_bringup.fault_drill.system_stand import SystemStand, passes, stamp
from flexarm_controller.limits import limits_of

if TYPE_CHECKING:
    from flexarm_bringup.fault_drill.live_rig_node import LiveRig

SAFE, LOST, BACK, LONGEST_STEP = 0.1, 0.3, 0.2, 0.1  # s
RETURNED, STAYED = 2.0, 0.05  # s after the sensors have come back; share of the motion that is no motion
RAMPED = 1.0 + 1e-9
SHORTEST_JUMP = 1.0  # s; more than any gap between two torques
ALL = ("encoder", "strain_gauge", "accelerometer", "camera")
BLIND = ("encoder", "camera")

Hit = Callable[["LiveRig"], None]


def silent(kinds: Sequence[str], bound: float) -> Callable[[SystemStand], list[Finding]]:
    """Return what lets all sensors of some kinds fall silent in a motion; it must end within ``bound`` s."""

    def play(stand: SystemStand) -> list[Finding]:
        """Play it on the graph by the clock."""
        names = [spec.name for spec in stand.stand.sensors if spec.kind in kinds]
        text = "; ".join(f"{name}: off" for name in names)
        return _played(stand, lambda rig, _: _ended(rig, bound), lambda rig: rig.tell_faults(text))

    return play


def jump(by: float) -> Callable[[SystemStand], list[Finding]]:
    """Return what lets the clock of all stamps jump by some seconds in a motion."""

    def play(stand: SystemStand) -> list[Finding]:
        """Play it on the graph by the clock."""
        return _played(stand, lambda rig, hit: _jumped(rig, hit, by), lambda rig: rig.jump_clock(by))

    return play


def _played(
    stand: SystemStand, judge: Callable[[LiveRig, float], list[Finding]], strike: Hit
) -> list[Finding]:
    """Arm, move, let something go wrong, and judge what came from then on."""
    from flexarm_bringup.fault_drill.live_rig_node import live_rig

    with live_rig(stand) as rig:
        rig.arm()
        rig.swing()
        rig.listen(UNDER_WAY)
        rig.forget()
        rig.listen(SILENCE)
        rig.wait(lambda: bool(rig.came["joint_states"]), "joint_states")
        hit = stamp(rig.came["joint_states"][-1][1])
        strike(rig)
        rig.listen(WATCHED)
        return judge(rig, hit)


def _ended(rig: LiveRig, bound: float) -> list[Finding]:
    """Judge a motion that sensors have ended, the encoders among them: from their last sample on.

    While they are silent joint_states come without axes.
    """
    hit = max(stamp(msg) for _, msg in rig.came["joint_states"] if msg.name)
    told = rig.came["modal_state"]
    lost = next(
        (_since(hit, msg) for _, msg in told if stamp(msg) > hit and msg.status == msg.LOST), math.inf
    )
    ended = min(_law_left(rig, hit), _guard_stopped(rig, hit))
    acted = [msg for _, msg in rig.came["controller_status"] if stamp(msg) > hit + bound]
    under_law = sum(msg.mode == msg.MPC for msg in acted)
    return [
        Finding("with nodes: state told to be lost after", lost, bound, "s"),
        Finding("with nodes: motion ended after", ended, bound, "s"),
        Finding("with nodes: torque rate / limit", _steepest(rig, hit), RAMPED),
        Finding("with nodes: law while the state is lost, cycles", under_law, 0),
        Finding("with nodes: gone on when all was well again, share", _gone_on(rig), STAYED),
    ]


def _gone_on(rig: LiveRig) -> float:
    """Give the sensors back; return how far the arm then goes by itself, over the way that was asked for."""
    course = rig.stand.stand.arm.course.reference.theta
    asked = float(np.linalg.norm(course - course[0], axis=1).max())
    since = stamp(rig.came["truth"][-1][1])
    rig.tell_faults("")
    rig.listen(RETURNED)
    theta = np.array([msg.theta for _, msg in rig.came["truth"] if stamp(msg) >= since])
    return float(np.linalg.norm(theta - theta[0], axis=1).max()) / asked


def _jumped(rig: LiveRig, hit: float, by: float) -> list[Finding]:
    """Judge a motion in which all stamps jumped; the state comes back, the motion does not."""
    states = [msg for _, msg in rig.came["modal_state"]]
    after = [msg for msg in states if abs(stamp(msg) - hit - by) < WATCHED]
    steps = np.diff([stamp(msg) for msg in after])
    begun = hit + by
    back = next((stamp(msg) - begun for msg in after if msg.status in (msg.OK, msg.DEGRADED)), math.inf)
    stopped = [at for at, msg in rig.came["guard_status"] if msg.mode != msg.ARMED]
    let_pass = [at for at, msg in rig.came["guard_status"] if stopped and at > stopped[0] and passes(msg)]
    rig.arm()
    return [
        Finding("with nodes: motion not stopped", float(not stopped), 0),
        Finding("with nodes: commands passed, not armed again", len(let_pass), 0),
        Finding("with nodes: time went back after the jump, steps", int(np.sum(steps < 0.0)), 0),
        Finding("with nodes: largest step afterwards", float(steps.max(initial=0.0)), LONGEST_STEP, "s"),
        Finding("with nodes: state may be used again after", back, BACK, "s"),
        Finding("with nodes: torque rate / limit", _steepest(rig, -math.inf), RAMPED),
    ]


def _law_left(rig: LiveRig, hit: float) -> float:
    """Return how long after the hit another rung than the law acted first [s]; infinity if none did."""
    told = [msg for _, msg in rig.came["controller_status"] if stamp(msg) > hit]
    return next((_since(hit, msg) for msg in told if msg.mode != msg.MPC), math.inf)


def _guard_stopped(rig: LiveRig, hit: float) -> float:
    """Return how long after the hit the guard stopped the arm [s]; infinity if it did not."""
    told = [msg for _, msg in rig.came["guard_status"] if stamp(msg) > hit]
    return next((_since(hit, msg) for msg in told if msg.mode != msg.ARMED), math.inf)


def _since(hit: float, msg: Any) -> float:
    """Return the time of a message after the hit [s]; stamps of today are floats to 0.2 us."""
    return round(stamp(msg) - hit, 6)


def _steepest(rig: LiveRig, since: float) -> float:
    """Return the largest change of an applied torque over what its limit allows, of neighbouring stamps."""
    rate = limits_of(rig.stand.stand.arm.config).effort_rate
    torques = [msg for _, msg in rig.came["applied_effort"] if stamp(msg) > since]
    steepest = 0.0
    for before, after in zip(torques, torques[1:], strict=False):
        seconds = stamp(after) - stamp(before)
        seconds = seconds if 0.0 < seconds < SHORTEST_JUMP else rig.stand.dt
        change = abs(np.array(after.effort) - np.array(before.effort))
        steepest = max(steepest, float((change / (rate * seconds)).max()))
    return steepest
