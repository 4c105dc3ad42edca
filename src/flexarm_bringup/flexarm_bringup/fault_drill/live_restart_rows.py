"""Row about restarts, with nodes: estimator or controller are killed in a motion, and it goes on."""

from __future__ import annotations

import math
import signal
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.fault_drill.controller_stand import ControllerStand
from flexarm_bringup.fault_drill.findings import ROUNDED, Finding
from flexarm_bringup.fault_drill.process_rows import WATCHED, news, strike
from flexarm_bringup.fault_drill.row import Row
from flexarm_bringup.fault_drill.system_stand import SystemStand, passes, stamp
from flexarm_controller.limits import limits_of
from flexarm_controller.trust import deviation_scale

if TYPE_CHECKING:
    from flexarm_bringup.fault_drill.live_rig_node import LiveRig

RECOVERY, WINDOW, E0S = 1.0, 0.1, 2.0  # s, s, multiples of e0
TRIES = 3  # to ask the law while the estimate is unsure


def restarts(stand: SystemStand) -> list[Finding]:
    """Kill estimator and controller in a motion, arm again when they are back, move on."""
    from flexarm_bringup.fault_drill.live_rig_node import live_rig

    with live_rig(stand) as rig:
        for _ in range(TRIES):
            findings = _restarted(rig, "estimator")
            if findings[
                0
            ].passed:  # else the estimator was sure before the arm, still braking, could be armed
                break
        return findings + _restarted(rig, "controller")


def _restarted(rig: LiveRig, name: str) -> list[Finding]:
    rig.arm()
    rig.swing()
    rig.listen(2.0 * WATCHED)
    e0 = _rms(_tip_errors(rig, -math.inf))
    strike(rig, name, signal.SIGKILL)
    rig.wait(lambda: any(not passes(msg) for _, msg in rig.came["guard_status"]), "the guard's stop")
    if name == "estimator":  # so that somebody asks the law as soon as there is a state, sure or not
        _arm_at_once(rig)
    else:
        rig.listen(WATCHED)
        rig.arm()
    armed = max(at for at, msg in rig.came["guard_status"] if not passes(msg))
    rig.swing()
    rig.listen(RECOVERY + WATCHED)
    torques = np.array([msg.effort for at, msg in rig.after("applied_effort", armed - WINDOW)])
    rate = limits_of(rig.stand.stand.arm.config).effort_rate * rig.stand.dt
    return [
        *(_blind(rig, rig.respawned.pop(name)) if name == "estimator" else ()),
        Finding(f"{name}: torque step / limit", float((abs(np.diff(torques, axis=0)) / rate).max()), ROUNDED),
        Finding(
            f"{name}: tip RMS within {E0S:g} e0 of the estimate again after",
            _back(rig, armed, e0),
            RECOVERY,
            "s",
        ),
    ]


def _arm_at_once(rig: LiveRig) -> None:
    """Ask for the arm to be armed until commands pass, whoever is ready."""
    told = rig.came["guard_status"]

    def is_passing() -> bool:
        """Ask if it is not armed; tell whether a command has passed."""
        if told[-1][1].mode != told[-1][1].ARMED:
            rig.ear.call("guard/arm")
        return passes(told[-1][1])

    rig.wait(is_passing, "commands to pass")


def _blind(rig: LiveRig, began: float) -> tuple[Finding, Finding]:
    """Return how many states of an estimator that begins anew were not sure, and which the law answered."""
    library = ControllerStand(rig.stand.name)
    scale = deviation_scale(library.model, library.mpc, library.dt)
    states = [msg for _, msg in news(rig, "estimator", began)]
    unsure = unsure_states(states, scale, library.config.start_sigma)
    answers = [msg for _, msg in rig.after("controller_status", began) if stamp(msg) in unsure]
    asked = sum(msg.mode != msg.INACTIVE for msg in answers)
    return (
        Finding("estimator: states before 3 sigma were small, answered", asked, 1, at_least=True),
        Finding("estimator: of these by the law", sum(msg.mode == msg.MPC for msg in answers), 0),
    )


def unsure_states(states: Sequence[Any], scale: NDArray[np.float64], limit: float) -> set[float]:
    """Return the stamps of states that must not be trusted: those before the first that is sure.

    Args:
        states: modal_state messages of an estimator, in their order.
        scale: Square root of what a deviation of each coordinate costs, (n_x,).
        limit: Largest 3 sigma of a sure state, in deviations that cost 1.
    """
    unsure = set()
    for msg in states:
        size = math.isqrt(len(msg.covariance))
        variances = np.array(msg.covariance[:: size + 1])[: scale.size]
        is_usable = msg.status not in (msg.LOST, msg.STARTING) and variances.size == scale.size
        if is_usable and 3.0 * (np.sqrt(variances) * scale).max() <= limit:
            break
        unsure.add(stamp(msg))
    return unsure


def _back(rig: LiveRig, since: float, e0: float) -> float:
    """Return from when on the error of the tip stays within ``E0S`` e0 [s]."""
    errors = _tip_errors(rig, since)
    bad = [at for at, _ in errors if _rms([e for e in errors if at - WINDOW < e[0] <= at]) > E0S * e0]
    return max(bad, default=since) - since


def _tip_errors(rig: LiveRig, since: float) -> list[tuple[float, float]]:
    """Return arrival and distance of the estimated tip from the true one [m], by stamp."""
    true = {stamp(msg): np.array(msg.tip[:3]) for _, msg in rig.came["truth"]}
    return [
        (at, float(np.linalg.norm(_position(msg) - true[stamp(msg)])))
        for at, msg in rig.after("end_effector", since)
        if stamp(msg) in true
    ]


def _position(msg: object) -> np.ndarray:
    point = msg.pose.pose.position  # type: ignore[attr-defined]
    return np.array([point.x, point.y, point.z])


def _rms(errors: Sequence[tuple[float, float]]) -> float:
    return math.sqrt(sum(error**2 for _, error in errors) / max(len(errors), 1))


ROWS = (
    Row(
        45, "estimator or controller killed in a move", "takes over when sure, without a jump", restarts, "N"
    ),
)
