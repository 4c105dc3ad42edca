"""The guard's settings, and the limits that follow from them and from the arm."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.guard import GuardLimits, JointRange
from flexarm_model.description import Axis, ManipulatorConfig
from flexarm_model.parameters import parameter
from flexarm_model.reduced_tree import ReducedTree

Array = NDArray[np.float64]
NOTICING = 3.0  # periods until a speed that is too high has been measured and judged


@dataclass(frozen=True)
class GuardSettings:
    """Settings of the guard."""

    max_age: float = parameter(0.05, "Silence of the controller that stops the arm.", "s", 0.005, 1.0)
    arming_time: float = parameter(2.0, "Time the controller has for its first command.", "s", 0.05, 60.0)
    braking_gain: float = parameter(
        0.075, "Share of an axis' velocity that braking takes away in a motor period.", "1", 1e-3, 0.5
    )
    braking_share: float = parameter(0.5, "Share of the torque limit that brakes at most.", "1", 0.05, 1.0)
    rest_velocity: float = parameter(0.01, "Axis velocity that counts as rest.", "rad/s", 1e-6, 1.0)


def guard_limits(config: ManipulatorConfig, tree: ReducedTree, settings: GuardSettings) -> GuardLimits:
    """Return the guard's limits: the axes' own, and braking that fits their inertia at home.

    Args:
        config: The manipulator; its rate is that of the motors.
        tree: Its dynamics.
        settings: Of the guard.
    """
    dt = round(1e9 / config.rate_hz) * 1e-9
    inertia = np.diag(tree.mass_matrix(tree.loops.home))[tree.actuated]
    axes = config.actuated.values()
    ranges = [joint_range(axis, float(i), dt, settings) for axis, i in zip(axes, inertia, strict=True)]
    return GuardLimits(
        effort=tuple(axis.effort for axis in axes),
        effort_rate=tuple(axis.effort_rate for axis in axes),
        damping=tuple(float(settings.braking_gain / dt * value) for value in inertia),
        braking=tuple(settings.braking_share * axis.effort for axis in axes),
        period=dt,
        max_age=settings.max_age,
        arming_time=settings.arming_time,
        rest_velocity=settings.rest_velocity,
        ranges=tuple(ranges),
    )


def joint_range(axis: Axis, inertia: float, dt: float, settings: GuardSettings) -> JointRange:
    """Return where an axis may be and how it brakes.

    Braking at ``min(a, r |v|)``, ``r = braking_gain / dt``, after the time ``t_r`` stops within
    ``(v + b)^2 / 2 a`` from every speed v when ``b = a (t_r + 1/r) / 2``. A larger ``a`` would stop a fast
    axis sooner, but leave it less range.

    Args:
        axis: Its limits.
        inertia: That its motor feels [kg m^2] or [kg].
        dt: Motor period [s].
        settings: Gain of braking and share of the torque.
    """
    braking = settings.braking_share * axis.effort
    reaction = NOTICING * dt + (axis.effort + braking) / axis.effort_rate + dt / settings.braking_gain
    deceleration = min(braking / inertia, axis.velocity / reaction)
    return JointRange(axis.lower, axis.upper, deceleration, deceleration * reaction / 2.0)
