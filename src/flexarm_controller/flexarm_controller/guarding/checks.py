"""What must not happen while the guard lets commands pass; every check returns why, or nothing."""

from __future__ import annotations

import math
from collections.abc import Sequence

from flexarm_controller.guarding.limits import GuardLimits
from flexarm_controller.guarding.messages import GuardCommand, GuardState

BRIDGED = 1  # periods without a command for which the last torque is kept
ROUNDED = 0.1  # periods by which an age may be beyond its limit: stamps are rounded, and come once a period
USTRAIN = 1e6  # per unit of strain


def unusable(effort: Sequence[float], axes: int) -> str:
    """Return why a command cannot be meant; empty when it can."""
    if len(effort) != axes:
        return f"command has {len(effort)} efforts, the arm has {axes} axes"
    if not all(math.isfinite(value) for value in effort):
        return "command is not finite"
    return ""


def went_back(t: float, before: float) -> str:
    """Return that time went back from one period [s] to the next, or is none; empty when it did not."""
    return "" if t >= before else f"time went from {before:.9g} to {t:.9g} s"


def mistimed(command: GuardCommand, t: float, limits: GuardLimits) -> str:
    """Return what is wrong with the times of a command now [s]; empty when nothing is."""
    period, most, delay = limits.period, limits.max_age, command.acts_at - command.t
    if not -period < t - command.t <= most + ROUNDED * period:
        return f"command is {1e3 * (t - command.t):.0f} ms old"
    if math.isnan(delay) or delay > most - (BRIDGED - ROUNDED) * period:
        after, age = f"{1e3 * delay:.0f} ms after its state", f"{1e3 * most:.0f} ms"
        return f"command acts {after}: of {age} no period is left"
    return ""


def too_fast(state: GuardState, limits: GuardLimits, gained: Sequence[float] = ()) -> str:
    """Return which axis is too fast for the end of its range, or will be; empty when none is.

    Args:
        state: What the drives tell.
        limits: Of the guard.
        gained: By how much the motors make every axis faster before braking acts [rad/s] or [m/s]; the
            margin of the range is for that.
    """
    if not limits.ranges:
        return ""
    if not len(state.velocity) == len(state.position) == len(limits.ranges):
        return "drives do not tell position and velocity of every axis"
    axes = zip(state.velocity, gained, limits.ranges, strict=False)
    ahead = [v + math.copysign(max(0.0, abs(more) - known.margin), more) for v, more, known in axes]
    for is_ahead, velocities in enumerate((state.velocity, ahead)):
        for axis, (q, v, known) in enumerate(zip(state.position, velocities, limits.ranges, strict=False)):
            allowed = known.allowed_at(q, v)
            if not abs(v) <= allowed + limits.rest_velocity:  # also when it is not a number
                label, how = limits.label(axis), "will be" if is_ahead else "is"
                much = f"{label.velocity(v)} of {label.velocity(allowed)}"
                at = f"{label.name} at {label.position(q, 4)}"
                return f"{at} {how} too fast for the end of its range: {much}"
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
