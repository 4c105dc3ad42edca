"""The open-loop motions of a move, all in the same time: best trapezoids, shapers, least torque.

Shapers are designed for the one or two modes that leave most of the vibration of the worst profile; one that
takes longer than the move, or that the arm could not follow, is left out with the reason.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from flexarm_bringup.compare_laws.least_torque import least_torque
from flexarm_bringup.compare_laws.legs import ComparedLeg
from flexarm_bringup.tip_vibration import Watch
from flexarm_controller.open_loop.axis_motion import Motion, PacedMotion, ShapedMotion
from flexarm_controller.open_loop.best_trapezoid import best_trapezoid
from flexarm_controller.open_loop.rest_to_rest import RestToRest, TorquePlan, fastest
from flexarm_controller.open_loop.vibration_left import VibrationLeft, Window
from flexarm_model.motion.hump_shapers import ei, three_hump, two_hump
from flexarm_model.motion.profiles import Trapezoid
from flexarm_model.motion.shapers import Shaper, convolve, mzv, zv, zvd

SHAPERS: dict[str, Callable[[float, float], Shaper]] = {
    "ZV": zv, "MZV": mzv, "ZVD": zvd, "EI": ei, "two-hump EI": two_hump, "three-hump EI": three_hump,
}  # fmt: skip
ROBUST = (0.9, 1.0, 1.1)  # factors on all frequencies that a robust choice looks at
TRAPEZOIDS = {"best trapezoid": (1.0,), "best trapezoid, f ±10 %": ROBUST}
SECOND_MODE = 0.05  # share of what the worst profile leaves from which on a second mode is shaped
LEAST_TORQUE = "least torque (LP)"
TWO_MODES = ", two modes"
MOTIONS = ("worst profile", *TRAPEZOIDS, *(f"{kind}{text}" for text in ("", TWO_MODES) for kind in SHAPERS),
           LEAST_TORQUE)  # fmt: skip
APART = 1.02  # ratio of two frequencies that one shaper does not serve both


@dataclass(frozen=True)
class LegMotions:
    """Open-loop motions of one move.

    Attributes:
        motions: By name, the worst profile first.
        left_out: Why a motion is missing, by its name.
        optimum: The time-optimal plan; None where there is no way to go.
    """

    motions: dict[str, Motion]
    left_out: dict[str, str]
    optimum: TorquePlan | None


def plan_motions(leg: ComparedLeg, watch: Watch, is_quick: bool) -> LegMotions:
    """Return all open-loop motions of a move; quick: without second modes and least torque."""
    given = leg.given
    motions: dict[str, Motion] = {"worst profile": given}
    left_out: dict[str, str] = {}
    for name, scales in TRAPEZOIDS.items():
        try:
            motions[name] = _best_trapezoid(leg, watch, scales)
        except ValueError as error:
            left_out[name] = str(error)
    for name, maker in _shapers(leg, watch, is_quick).items():
        try:
            motion = ShapedMotion(given, maker()).stretched(given.duration)
        except ValueError as error:
            left_out[name] = str(error)
            continue
        excess = leg.excess(motion)
        if excess:
            left_out[name] = f"beyond the limit of {excess}"
        else:
            motions[name] = motion
    problem = RestToRest(leg.middle, leg.limits, leg.start, leg.goal, leg.dt)
    periods = int(given.duration / leg.dt + 1e-6)
    optimum = fastest(problem, periods) if leg.goes_somewhere else None
    if optimum is not None and not is_quick:
        try:
            motions[LEAST_TORQUE] = least_torque(leg, periods)
        except ValueError as error:
            left_out[LEAST_TORQUE] = str(error)
    return LegMotions(motions, left_out, optimum)


def robust_choice(leg: ComparedLeg, watch: Watch, motions: dict[str, Motion]) -> str:
    """Return the name of the shaped motion that leaves least at the worst of f -10 %, 0, +10 %."""
    shaped = [name for name, motion in motions.items() if isinstance(motion, ShapedMotion)]
    return min(shaped, key=lambda name: _worst(leg, watch, ROBUST)(motions[name]), default="worst profile")


def _worst(leg: ComparedLeg, watch: Watch, scales: tuple[float, ...]) -> Callable[[Motion], float]:
    window = Window(watch.begin, watch.end, watch.cutoff_hz)
    arms = [VibrationLeft(leg.model, window, leg.dt, scale) for scale in scales]
    return lambda motion: max(arm.rms(motion) for arm in arms)


def _best_trapezoid(leg: ComparedLeg, watch: Watch, scales: tuple[float, ...]) -> PacedMotion:
    left, way = _worst(leg, watch, scales), leg.given.way

    def cost(trapezoid: Trapezoid) -> float:
        """Return the vibration it leaves in the worst of the modelled arms."""
        return left(PacedMotion(way, trapezoid))

    def allowed(trapezoid: Trapezoid) -> bool:
        """Return whether velocity, torque and strain stay within their limits."""
        return leg.is_allowed(PacedMotion(way, trapezoid))

    return PacedMotion(way, best_trapezoid(leg.given.duration, cost, allowed))


def _shapers(leg: ComparedLeg, watch: Watch, is_quick: bool) -> dict[str, Callable[[], Shaper]]:
    """Return the shapers by name, not yet designed: that may fail."""
    modes = _modes(leg, watch)

    def design(kind: str, count: int) -> Shaper:
        """Return the shaper of the first modes."""
        parts = [SHAPERS[kind](float(leg.model.omega[i]), float(leg.model.zeta[i])) for i in modes[:count]]
        return parts[0] if count == 1 else convolve(*parts)

    def of_modes(kind: str, count: int) -> Callable[[], Shaper]:
        """Return what designs it later."""
        return lambda: design(kind, count)

    counts = {1: ""} if is_quick or len(modes) < 2 else {1: "", 2: TWO_MODES}
    return {f"{kind}{text}": of_modes(kind, count) for count, text in counts.items() for kind in SHAPERS}


def _modes(leg: ComparedLeg, watch: Watch) -> list[int]:
    """Return the one or two modes that leave most of the worst profile's vibration, most first.

    Raises:
        ValueError: The arm has none.
    """
    left = VibrationLeft(leg.model, Window(watch.begin, watch.end, watch.cutoff_hz), leg.dt)
    share = left.by_mode(leg.given) / max(left.rms(leg.given), float(np.finfo(float).tiny))
    order = [int(i) for i in np.argsort(-share)]
    if not order:
        raise ValueError("nothing to compare: no mode is served (served.modes is 0), so nothing vibrates")
    first, omega = order[0], leg.model.omega
    apart = [i for i in order[1:] if max(omega[i], omega[first]) > APART * min(omega[i], omega[first])]
    return [first, *(i for i in apart[:1] if share[i] >= SECOND_MODE)]
