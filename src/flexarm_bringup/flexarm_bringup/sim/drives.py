"""The drives of the simulated rig: what sits on the motors' side of the guard.

In one motor period the arm moves under the torque chosen before, and the sensors speak; then somebody chooses
the torque that acts from now on. A drive knows its axis from an encoder of its own. A fault of the sensor
``encoder`` is one on the way to the estimator: it spoils what ``joint_states`` tells, not what the drive does
with its motor. On a real rig a drive whose own encoder fails cannot commutate: it switches itself off, closes
its brake, and ``drive_states`` ends.

Brakes that close take the velocity of their axes within 50 ms, or longer where that needs more torque than
the half of what the motor has; then the axes stand, and the links ring on.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.sim.motor_side import MotorSide
from flexarm_bringup.sim.plant import Plant
from flexarm_bringup.sim.rig import Rig, RigSettings
from flexarm_bringup.sim.sample import Sample
from flexarm_bringup.sim.sensor_faults import SensorFault
from flexarm_controller.drives.watchdog import DriveLimits
from flexarm_controller.guard import GuardState
from flexarm_model.manipulator.description import ManipulatorConfig

Array = NDArray[np.float64]

DAMPING_GAIN = 0.075  # share of an axis' velocity that joint damping takes away in a motor period
BRAKING_SHARE = 0.5  # of the torque limit that it takes at most, and that a brake has beside what it holds
SLOW = 0.05  # of the velocity limit: brakes may close
BRAKE_TIME = 0.05  # s in which a brake takes the velocity of its axis at the soonest


class Drives:
    """Rig and drives.

    Attributes:
        rig: The arm and its sensors.
        names: Actuated axes.
        motors: What the encoders tell, with their faults.
        own: What the drives measure for themselves.
        tau: Torque that acts from now on, one per axis [N m] or [N].
        acted: Torque that acted until now.
        is_released: The brakes are open.
    """

    def __init__(
        self,
        config: ManipulatorConfig,
        simulation: RigSettings | None = None,
        plant: Plant | None = None,
        faults: Mapping[str, SensorFault] | None = None,
    ) -> None:
        """Build them at rest with closed brakes; see ``Hardware``."""
        self.rig = Rig(config, simulation, plant, faults)
        self.motors = MotorSide(config, self.rig.dt)
        self.own = MotorSide(config, self.rig.dt) if self.rig.hides_encoders else self.motors
        self.names = self.motors.names
        self.tau: list[float] = [0.0] * len(self.names)
        self.acted = list(self.tau)
        self.is_released = False
        self._slowing: Array | None = (
            None  # of brakes that have closed [rad/s^2], (n_theta,); at first none has
        )

    @property
    def t(self) -> float:
        """Time since the start [s]."""
        return self.rig.time_of(self.rig.tick)

    def observe(self) -> list[Sample]:
        """Return what the sensors deliver before anything has moved; call it once, at the start."""
        return self._measure(self.rig.observe())

    def advance(self) -> list[Sample]:
        """Move by one period under the torque chosen before; return what the sensors deliver."""
        self.acted = list(self.tau)
        if self.is_released:
            return self._measure(self.rig.step(np.array(self.acted)))
        if self._slowing is None:
            return self._measure(self.rig.rest())
        stop = -self.rig.plant.theta_dot / self.rig.dt
        return self._measure(self.rig.servo(np.clip(stop, -self._slowing, self._slowing)))

    def open_brakes(self) -> None:
        """Let the arm move."""
        self.is_released = True

    def close_brakes(self) -> None:
        """Bring the axes to rest, where they are open, and hold them there."""
        if self.is_released:
            plant = self.rig.plant
            inertia = np.diag(plant.tree.mass_matrix(plant.q))[plant.tree.actuated]
            torque = [BRAKING_SHARE * axis.effort for axis in self.rig.config.actuated.values()]
            self._slowing = np.minimum(np.array(torque) / inertia, abs(plant.theta_dot) / BRAKE_TIME)
            self.is_released = False

    def state(self, strain: tuple[float, ...] = ()) -> GuardState:
        """Return what the drives measure now, beside what the gauges told."""
        return GuardState(tuple(self.own.velocity), tuple(self.own.position), strain)

    def set_faults(self, faults: Mapping[str, SensorFault]) -> None:
        """Change what is wrong with the sensors; times of the faults count from now."""
        self.rig.set_faults(faults)
        if self.rig.hides_encoders and self.own is self.motors:
            self.own = copy.deepcopy(self.motors)

    def _measure(self, samples: list[Sample]) -> list[Sample]:
        self.motors.update(samples)
        if self.own is not self.motors:
            self.own.update(self.rig.own_encoders)
        return samples


def drive_limits(config: ManipulatorConfig, rig: Rig, silence: float, brake_time: float) -> DriveLimits:
    """Return the drives' limits: the axes' own, and damping that fits their inertia at home.

    Args:
        config: The manipulator.
        rig: The simulated arm.
        silence: Of the guard, after which the drives let go [s].
        brake_time: After which they close their brakes then at the latest [s].
    """
    tree = rig.plant.tree
    inertia = np.diag(tree.mass_matrix(rig.plant.q))[tree.actuated]
    axes = config.actuated.values()
    return DriveLimits(
        effort=tuple(axis.effort for axis in axes),
        effort_rate=tuple(axis.effort_rate for axis in axes),
        damping=tuple(float(DAMPING_GAIN / rig.dt * value) for value in inertia),
        braking=tuple(BRAKING_SHARE * axis.effort for axis in axes),
        period=rig.dt,
        brake_velocity=tuple(SLOW * axis.velocity if axis.velocity < math.inf else 0.0 for axis in axes),
        silence=silence,
        brake_time=brake_time,
    )
