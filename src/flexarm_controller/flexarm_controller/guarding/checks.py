"""What must not happen while the guard lets commands pass; every check returns why, or nothing."""

from __future__ import annotations

import math
from collections.abc import Sequence

from flexarm_controller.guarding.limits import GuardLimits
from flexarm_controller.guarding.messages import GuardState

USTRAIN = 1e6  # per unit of strain


def unusable(effort: Sequence[float], axes: int) -> str:
    """Return why a command cannot be meant; empty when it can."""
    if len(effort) != axes:
        return f"command has {len(effort)} efforts, the arm has {axes} axes"
    if not all(math.isfinite(value) for value in effort):
        return "command is not finite"
    return ""


def too_fast(state: GuardState, limits: GuardLimits) -> str:
    """Return which axis is too fast for the end of its range; empty when none is."""
    if not limits.ranges:
        return ""
    if not len(state.velocity) == len(state.position) == len(limits.ranges):
        return "drives do not tell position and velocity of every axis"
    for axis, (q, v, known) in enumerate(zip(state.position, state.velocity, limits.ranges, strict=True)):
        allowed = known.allowed_at(q, v)
        if not abs(v) <= allowed + limits.rest_velocity:  # also when it is not a number
            label = limits.label(axis)
            much = f"{label.velocity(v)} of {label.velocity(allowed)}"
            return f"{label.name} at {label.position(q, 4)} is too fast for the end of its range: {much}"
    return ""


def over_speed(velocity: Sequence[float], limits: GuardLimits) -> str:
    """Return which axis is faster than it may be anywhere; empty when none is, or there are no limits."""
    if limits.velocity and len(velocity) != len(limits.velocity):
        return "drives do not tell the velocity of every axis"
    for axis, (v, most) in enumerate(zip(velocity, limits.velocity, strict=False)):
        if most < math.inf and not abs(v) <= most:  # also when it is not a number
            label = limits.label(axis)
            return f"{label.name} is faster than it may be: {label.velocity(v)} of {label.velocity(most)}"
    return ""


def overstrained(strain: Sequence[float], limits: GuardLimits) -> str:
    """Return which gauge is strained beyond its limit; a silent gauge (NaN) is none, nor are no gauges."""
    if not strain:
        return ""
    if len(strain) != len(limits.strain):
        return f"{len(strain)} strains, the arm has {len(limits.strain)} gauges with a limit"
    for gauge, (value, most) in enumerate(zip(strain, limits.strain, strict=True)):
        if abs(value) > most:
            much = f"{USTRAIN * value:.4g} of {USTRAIN * most:.4g} ustrain"
            return f"{limits.gauge(gauge)} is strained beyond its limit: {much}"
    return ""


def too_much_energy(energy: float, limits: GuardLimits) -> str:
    """Return that the motors have put too much energy into the arm [J]; empty when they have not."""
    if energy <= limits.energy:
        return ""
    window = 1e3 * limits.energy_window
    return f"motors have put {energy:.3g} of {limits.energy:.3g} J into the arm within {window:.0f} ms"
