"""An arm driven through the guard, tick by tick, and what its sensors said.

The arm is held at its pose; an excitation is added to the torque. Rows are instants: the samples stamped
with it and the torque that acts from it on. A command computed from the state of a tick acts from the next
one on, as over DDS.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.excite.held_arm import HeldArm
from flexarm_bringup.identify.measurement import COMMON, KIND_OF_UNIT, LEFT_OUT, SourceError
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.sample import Sample
from flexarm_controller.guard import ARMED, GuardCommand
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.manipulator.sensor_spec import SensorSpec
from flexarm_model.modal.read_only import lock_arrays
from flexarm_model.tree.sensors import output_names, output_units

Array = NDArray[np.float64]
TOKEN = 1


class DriveError(SourceError):
    """The guard stopped the arm; the message says why."""


@dataclass(frozen=True)
class Channel:
    """One channel that is sampled in every period.

    Attributes:
        name: "sensor.channel" as the model's output rows.
        row: In the model's outputs.
        unit: SI.
        spec: Its sensor.
        sigma: Described noise, SI.
    """

    name: str
    row: int
    unit: str
    spec: SensorSpec
    sigma: float

    @property
    def kind(self) -> str:
        """What it is of a displacement."""
        return KIND_OF_UNIT.get(self.unit, COMMON)


@dataclass(frozen=True)
class Driven:
    """A stretch of time.

    Attributes:
        tau: Torque of the drives from each instant on [N m or N], (n, n_theta).
        added: The part that excites, (n, n_theta).
        y: Samples, nan where none came, SI, (n, channels).
    """

    tau: Array
    added: Array
    y: Array

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        lock_arrays(self)


def channels(config: ManipulatorConfig) -> tuple[Channel, ...]:
    """Return the channels that are sampled in every period and tell of shapes, in the order described."""
    units, rows = output_units(config), {name: row for row, name in enumerate(output_names(config))}
    return tuple(
        Channel(name, rows[name], units[rows[name]], spec, float(sigma))
        for spec in config.sensors
        if not spec.rate_hz
        for channel, sigma in zip(spec.channels, spec.sigma, strict=True)
        for name in (f"{spec.name}.{channel}",)
        if units[rows[name]] not in LEFT_OUT
    )


class Drive:
    """A rig under the holding law; time goes on from call to call."""

    def __init__(self, hardware: Hardware, arm: HeldArm) -> None:
        """Arm the guard of a rig at tick 0."""
        self.arm, self.hardware, self.channels = arm, hardware, channels(arm.config)
        self._first = {channel.spec.name: i for i, channel in reversed([*enumerate(self.channels)])}
        hardware.guard.arm(hardware.t, TOKEN)
        self._take(hardware.observe(), np.zeros((0, 0)), 0)

    def run(self, added: Array) -> Driven:
        """Add torques to those that hold the arm, (n, n_theta) [N m or N], and return what happened.

        Raises:
            DriveError: The guard stopped the arm.
        """
        n, start, motors = len(added), self.hardware.tick + 1, self.hardware.motors
        y, tau = np.full((n, len(self.channels)), np.nan), np.zeros_like(added)
        for k in range(n):
            wanted = self.arm.torque(motors.theta, motors.theta_dot) + added[k]
            stamp, sequence = self.hardware.t, self.hardware.tick
            self._take(self.hardware.advance(), y, start)
            command = GuardCommand(stamp, sequence, TOKEN, tuple(map(float, wanted)))
            tau[k] = self.hardware.choose_torque(command)
            if self.hardware.guard.mode != ARMED:
                raise DriveError(f"after {self.hardware.t:.2f} s the guard stopped the arm: {self._reason()}")
        return Driven(tau, added, y)

    def _reason(self) -> str:
        return (
            f"{self.hardware.guard.reason}; an encoder or a motor of the wrong sign makes holding unstable, "
            "and a softer arm moves further: try a smaller --share"
        )

    def _take(self, samples: Sequence[Sample], y: Array, start: int) -> None:
        """Put samples into the rows of their instants."""
        for sample in samples:
            first = self._first.get(sample.sensor)
            if first is None:
                continue
            late = 1e-9 * sample.late_ns - self.channels[first].spec.stamp_delay  # s
            row = sample.tick - start + round(late / self.hardware.dt)
            if 0 <= row < len(y):
                y[row, first : first + sample.y.size] = sample.y
