"""What the guard enforces."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from flexarm_controller.guarding.axis_label import AxisLabel, number_axis
from flexarm_controller.guarding.joint_range import JointRange
from flexarm_controller.guarding.loads import Loads


@dataclass(frozen=True)
class Braking:
    """How an arm is brought to rest and held; one value per axis, or one for all.

    Attributes:
        deceleration: Of a stop: it ends within ``v^2 / 2 a`` [rad/s^2] or [m/s^2].
        peak: Largest deceleration, where reaction or load have cost way [rad/s^2] or [m/s^2].
        taper: Share of the velocity that braking takes away at most, which matters near rest [1/s].
        rate: Of holding, at most: damping over inertia; its spring is critically damped [1/s].
        lead: Time from measuring a velocity to the torque that answers it [s].
    """

    deceleration: tuple[float, ...]
    peak: tuple[float, ...]
    taper: float
    rate: float
    lead: float


@dataclass(frozen=True)
class GuardLimits:
    """What the guard enforces; one value per axis or gauge.

    Attributes:
        effort: Largest torque [N m] or force [N].
        effort_rate: Its largest rate [N m/s] or [N/s].
        braking: How the arm is brought to rest.
        loads: What the arm asks of its motors, until the guard is told better.
        period: Motor period [s].
        max_age: Silence that stops the arm [s].
        arming_time: Time the controller has for its first command [s].
        rest_velocity: Below this an axis is at rest [rad/s] or [m/s].
        ranges: Where the axes may be; empty for anywhere.
        velocity: How fast they may be [rad/s] or [m/s]; inf, or empty, for any velocity.
        strain: Largest strain of every gauge; empty for any [1].
        energy: Largest energy that the motors put in over ``energy_window`` [J].
        energy_window: Time over which it is summed [s].
        noise: By how much the way of every axis and the integral of its velocity may differ over
            ``rest_watch.REST_TIME`` [rad] or [m]; empty for by any.
        velocity_delay: By how much the drives' velocity may be late [s].
        changeover: Time for which commands of the model served before still pass [s].
        labels: What messages call the axes; empty for their numbers.
        gauges: Names of the gauges for messages; empty for their numbers alone.
    """

    effort: tuple[float, ...]
    effort_rate: tuple[float, ...]
    braking: Braking
    loads: Loads
    period: float
    max_age: float = 0.05
    arming_time: float = 2.0
    rest_velocity: float = 0.01
    ranges: tuple[JointRange, ...] = ()
    velocity: tuple[float, ...] = ()
    strain: tuple[float, ...] = ()
    energy: float = math.inf
    energy_window: float = 0.25
    noise: tuple[float, ...] = ()
    velocity_delay: float = 0.01
    changeover: float = 1.0
    labels: tuple[AxisLabel, ...] = ()
    gauges: tuple[str, ...] = ()

    def label(self, axis: int) -> AxisLabel:
        """Return what messages call an axis."""
        return self.labels[axis] if self.labels else number_axis(axis)

    def borne(self, holding: Sequence[float]) -> list[float]:
        """Return of a holding torque what the motors can bear [N m] or [N]."""
        return [max(-most, min(most, held)) for held, most in zip(holding, self.effort, strict=True)]

    def gauge(self, gauge: int) -> str:
        """Return what messages call a gauge, "gauge 2 (root_strain)"."""
        return f"gauge {gauge + 1}" + (f" ({self.gauges[gauge]})" if self.gauges else "")
