"""The rig with its guard: what sits on the motors' side of the command topic.

One motor period: the arm moves under the torque chosen before, the sensors speak, and the guard chooses the
next torque from the newest command. A command computed from the state of tick k acts from tick k + 1 on.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.sim.motor_side import MotorSide
from flexarm_bringup.sim.plant import Plant
from flexarm_bringup.sim.rig import Rig, RigSettings
from flexarm_bringup.sim.sensor_faults import SensorFault
from flexarm_bringup.sim.sensor_simulator import Sample
from flexarm_controller.guard import STOPPED, Guard, GuardCommand, GuardLimits, GuardState, JointRange
from flexarm_model.description import Axis, ManipulatorConfig
from flexarm_model.parameters import parameter

Array = NDArray[np.float64]
NOTICING = 3.0  # periods until a speed that is too high has been measured and judged


@dataclass(frozen=True)
class HardwareSettings:
    """Settings of the guard."""

    max_age: float = parameter(0.05, "Silence of the controller that stops the arm.", "s", 0.005, 1.0)
    arming_time: float = parameter(2.0, "Time the controller has for its first command.", "s", 0.05, 60.0)
    braking_gain: float = parameter(
        0.075, "Share of an axis' velocity that braking takes away in a motor period.", "1", 1e-3, 0.5
    )
    braking_share: float = parameter(0.5, "Share of the torque limit that brakes at most.", "1", 0.05, 1.0)
    rest_velocity: float = parameter(0.01, "Axis velocity that counts as rest.", "rad/s", 1e-6, 1.0)


class Hardware:
    """Rig, drives and guard."""

    def __init__(
        self,
        config: ManipulatorConfig,
        simulation: RigSettings | None = None,
        settings: HardwareSettings | None = None,
        plant: Plant | None = None,
        faults: Mapping[str, SensorFault] | None = None,
    ) -> None:
        """Build it at rest with the guard stopped.

        Args:
            config: The manipulator.
            simulation: Of the rig.
            settings: Of the guard.
            plant: A compiled plant to reuse.
            faults: What is wrong with the sensors, by name.
        """
        self.rig = Rig(config, simulation, plant, faults)
        self.motors = MotorSide(config, self.rig.dt)
        self.names = self.motors.names
        self.guard = Guard(guard_limits(config, self.rig, settings or HardwareSettings()))
        self.tau: list[float] = [0.0] * len(self.names)  # acts from now on
        self.acted = list(self.tau)  # acted until now
        self._is_released = False  # brakes hold the arm until the guard is armed for the first time

    @property
    def dt(self) -> float:
        """Motor period [s]."""
        return self.rig.dt

    @property
    def tick(self) -> int:
        """Periods since the start."""
        return self.rig.tick

    @property
    def t(self) -> float:
        """Time since the start [s]."""
        return self.rig.time_of(self.rig.tick)

    def observe(self) -> list[Sample]:
        """Return what the sensors deliver before anything has moved; call it once, at the start."""
        samples = self.rig.observe()
        self.motors.update(samples)
        return samples

    def advance(self) -> list[Sample]:
        """Move by one period under the torque chosen before; return what the sensors deliver."""
        self.acted = list(self.tau)
        self._is_released |= self.guard.mode != STOPPED
        samples = self.rig.step(np.array(self.acted)) if self._is_released else self.rig.rest()
        self.motors.update(samples)
        return samples

    def choose_torque(self, command: GuardCommand | None) -> list[float]:
        """Let the guard choose the torque of the period that starts now [N m], (n_theta,)."""
        measured = (self.motors.theta_dot, self.motors.theta)
        self.tau = self.guard.step(
            command, GuardState(*(tuple(map(float, part)) for part in measured)), self.t
        )
        return self.tau


def guard_limits(config: ManipulatorConfig, rig: Rig, settings: HardwareSettings) -> GuardLimits:
    """Return the guard's limits: the axes' own, and braking that fits their inertia at home."""
    tree = rig.plant.tree
    inertia = np.diag(tree.mass_matrix(rig.plant.q))[tree.actuated]
    axes = config.actuated.values()
    ranges = [joint_range(axis, float(i), rig.dt, settings) for axis, i in zip(axes, inertia, strict=True)]
    return GuardLimits(
        effort=tuple(axis.effort for axis in axes),
        effort_rate=tuple(axis.effort_rate for axis in axes),
        damping=tuple(float(settings.braking_gain / rig.dt * value) for value in inertia),
        braking=tuple(settings.braking_share * axis.effort for axis in axes),
        period=rig.dt,
        max_age=settings.max_age,
        arming_time=settings.arming_time,
        rest_velocity=settings.rest_velocity,
        ranges=tuple(ranges),
    )


def joint_range(axis: Axis, inertia: float, dt: float, settings: HardwareSettings) -> JointRange:
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
