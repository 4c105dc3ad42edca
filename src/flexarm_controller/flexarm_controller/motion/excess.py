"""Where a trajectory of the axes goes beyond what the arm can do, found exactly.

Between two samples position is a cubic and acceleration a line in time, so that position, velocity and the
quasi-static torque ``K theta + D theta' + J theta'' + u_0`` of the served model are cubics in s = 0 ... 1.
So is the torque on a `Way`, which changes with the pose, in parts of the interval that it makes. Their
extremes lie at the ends of the interval or where the derivative, a quadratic, vanishes. The strain at gauges
rings, too (`Strains`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.guarding.checks import USTRAIN
from flexarm_controller.limits import Limits
from flexarm_controller.motion.cubics import EXTREMES, extremes
from flexarm_controller.motion.strains import Strains
from flexarm_controller.motion.torques import Torques
from flexarm_model.motion.trajectory import Trajectory
from flexarm_model.settings.units import is_sliding

Array = NDArray[np.float64]
ROUNDING = 1e-9  # of a limit
NANOSECOND = 1e-9  # s; stamps of messages are whole ones
MOST_SLACK = 0.01  # of a velocity, however short the interval


@dataclass(frozen=True)
class Excess:
    """The worst violation of one limit.

    Attributes:
        axis: Index of the axis, or of the limited gauge.
        name: Its name, "joint.axis" or "gauge.channel".
        quantity: "position", "velocity", "torque" or "strain".
        value: What the trajectory asks for [rad, rad/s, N m; m, m/s, N; 1].
        limit: What is allowed.
        t: When, from the first sample on [s].
    """

    axis: int
    name: str
    quantity: str
    value: float
    limit: float
    t: float

    def __str__(self) -> str:
        if self.quantity == "strain":
            return self._told(f"gauge {self.name}: strain", "ustrain", USTRAIN)
        length = "m" if is_sliding(self.name) else "rad"
        units = {"position": length, "velocity": f"{length}/s", "torque": torque_unit(self.name)}
        what = "leaves the joint limits: position" if self.quantity == "position" else self.quantity
        return self._told(f"axis {self.name}: {what}", units[self.quantity])

    def _told(self, what: str, unit: str, scale: float = 1.0) -> str:
        value, limit = scale * self.value, scale * self.limit
        return f"{what} {value:.4g} {unit} is beyond the limit {limit:.4g} {unit} at {self.t:.3f} s"


def torque_unit(name: str) -> str:
    """Return the unit of the torque of an axis by its name, "joint.axis"."""
    return "N" if is_sliding(name) else "N m"


def find_excess(
    trajectory: Trajectory,
    limits: Limits,
    names: Sequence[str] = (),
    equilibrium: Torques | None = None,
    strains: Strains | None = None,
) -> Excess | None:
    """Return the worst excess of the first quantity that has one: position, velocity, torque, strain.

    Args:
        trajectory: Of the axes; before and after it they rest.
        limits: Of the arm.
        names: Of the axes, "joint.axis"; numbers where not given.
        equilibrium: Torque that goes with a motion; None: torque is not looked at.
        strains: That go with a motion; None: they are not looked at.
    """
    names = names or tuple(f"{i + 1}" for i in range(limits.effort.size))
    shares = {"position": (limits.position_low, limits.position_high)}
    shares["velocity"] = (-limits.velocity, limits.velocity)
    shares["torque"] = (-limits.effort, limits.effort)
    if strains is not None:
        shares["strain"] = (-strains.limit, strains.limit)
    for quantity, t, values in peaks(trajectory, equilibrium, strains):
        low, high = shares[quantity]
        over = np.maximum(values - high, low - values)  # (k, n)
        ends = [np.where(np.isfinite(end), abs(end), 0.0) for end in (low, high)]
        size = np.maximum(*ends)  # one of them may be zero
        size = np.where(size > 0.0, size, 1.0)
        beyond = over / size - ROUNDING
        if quantity == "velocity" and trajectory.t.size > 1:
            beyond -= _of_stamps(trajectory)
        worst, axis = divmod(int(beyond.argmax()), over.shape[1])
        if beyond[worst, axis] > 0.0:
            value, limit = values[worst, axis], high if values[worst, axis] > high[axis] else low
            at = float(t[worst, axis] - trajectory.t[0])
            name = strains.names[axis] if strains and quantity == "strain" else names[axis]
            return Excess(axis, name, quantity, float(value), float(limit[axis]), at)
    return None


def _of_stamps(trajectory: Trajectory) -> Array:
    """Return what rounded instants may make of a velocity, of its limit, for every extreme, (k, 1).

    A cubic goes its way in the time between two samples, however that was rounded: ``3 dt / h`` of its speed.
    """
    slack = np.minimum(3.0 * 2.0 * resolution_of(trajectory) / np.diff(trajectory.t), MOST_SLACK)
    return np.tile(slack, EXTREMES)[:, None]


def resolution_of(trajectory: Trajectory) -> float:
    """Return by how much instants of a message, in whole nanoseconds, may be rounded [s]."""
    return NANOSECOND + float(np.spacing(abs(trajectory.t).max()))


def peaks(
    trajectory: Trajectory, equilibrium: Torques | None, strains: Strains | None = None
) -> Iterator[tuple[str, Array, Array]]:
    """Return every quantity with the instants [s] and values of its local extremes, both (k, n_theta).

    Of strain there are (k, n_gauges), those of `Strains.peaks`.
    """
    yield from _of_axes(trajectory, equilibrium)
    if strains is not None:
        yield "strain", *strains.peaks(trajectory)


def _of_axes(trajectory: Trajectory, equilibrium: Torques | None) -> Iterator[tuple[str, Array, Array]]:
    if trajectory.t.size == 1:
        still = np.zeros_like(trajectory.theta)
        t = np.broadcast_to(trajectory.t[:, None], still.shape)
        yield "position", t, trajectory.theta
        yield "velocity", t, still
        if equilibrium is not None:
            yield "torque", t, equilibrium.holding(trajectory.theta)
        return
    p0, v0, c2, c3, _, _, h = trajectory._cubics.swapaxes(0, 1)  # each (k - 1, n)
    position, velocity = (p0, v0, c2, c3), (v0 / h, 2 * c2 / h, 3 * c3 / h, np.zeros_like(p0))
    yield "position", *_extremes(trajectory, position)
    yield "velocity", *_extremes(trajectory, velocity)
    if equilibrium is not None:
        yield "torque", *_extremes(*equilibrium.cubics(trajectory))


def _extremes(trajectory: Trajectory, cubic: Sequence[Array]) -> tuple[Array, Array]:
    """Return instants and values at both ends of every interval and where the derivative vanishes."""
    s, values = extremes(cubic)
    t = trajectory.t[:-1, None] + s * np.diff(trajectory.t)[:, None]
    n = values.shape[2]
    return t.reshape(-1, n), values.reshape(-1, n)
