"""The kinds of moves of a task file: each turns a start and an arm into a motion of the actuated axes.

- ``by: {base.rz: 30 deg}``: named axes by so much, all on one profile;
- ``to: B``: all axes to a pose of the description, or to "home";
- ``shift: [40 mm, 0 mm, 0 mm]``: the tip along a straight line;
- ``square: {side: 400 mm, ...}``: the tip around a horizontal square with rounded corners.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.static_arm import StaticArm
from flexarm_model.kinematics.paths import (
    CartesianMotion,
    Way,
    at_speed,
    rounded_square,
    straight_move,
    travel,
)
from flexarm_model.kinematics.refusals import KinematicsError
from flexarm_model.manipulator.description import AXES
from flexarm_model.motion.profiles import Profile, Quintic, Trapezoid
from flexarm_model.settings.strict_yaml import Section
from flexarm_model.settings.units import axis_dimension

Array = NDArray[np.float64]
SAMPLE = 0.01  # s between two points of a path of the tip; the axes' spline goes through them


@dataclass(frozen=True)
class AxisMotion:
    """Motion of the actuated axes from rest to rest: times from its start [s] (k,), and (k, n_theta) each."""

    t: Array
    theta: Array
    theta_dot: Array
    theta_ddot: Array


class TaskMove(Protocol):
    """One move."""

    @property
    def profile(self) -> Profile:
        """Share of the way by time, from 0 to 1."""
        ...

    def plan(self, arm: StaticArm, start: Array, dt: float) -> AxisMotion:
        """Return the motion of ``arm`` from the axes at ``start`` (n_theta,), about every ``dt`` [s].

        Raises:
            ValueError: The arm cannot do it; says why.
        """
        ...


@dataclass(frozen=True)
class ByAxes:
    """Named axes by so much [rad or m], on one profile from 0 to 1."""

    distance: dict[str, float]
    profile: Profile

    def plan(self, arm: StaticArm, start: Array, dt: float) -> AxisMotion:
        """Return the motion; see ``TaskMove``."""
        return _straight(start, arm.vector(self.distance), self.profile, dt)


@dataclass(frozen=True)
class ToPose:
    """All axes to a pose of the description, on one profile from 0 to 1."""

    pose: str
    profile: Profile

    def plan(self, arm: StaticArm, start: Array, dt: float) -> AxisMotion:
        """Return the motion; see ``TaskMove``."""
        return _straight(start, arm.named_pose(self.pose) - start, self.profile, dt)


@dataclass(frozen=True)
class ShiftTip:
    """The tip by a vector [m], (3,), in a straight line on one profile from 0 to 1."""

    shift: Array
    keep_orientation: bool
    profile: Profile

    def plan(self, arm: StaticArm, start: Array, dt: float) -> AxisMotion:
        """Return the motion; see ``TaskMove``."""
        here = arm.pose(start)
        there = here.copy()
        there[:3, 3] += self.shift
        motion = straight_move(here, there, self.profile, _times(self.profile.duration))
        return _along(arm, motion, start, self.keep_orientation)


@dataclass(frozen=True)
class SquareTip:
    """The tip around a horizontal square, from the middle of one side, with the orientation it has there.

    Attributes:
        side: Of the square before rounding [m].
        radius: Of its corners [m].
        speed: Along the way [m/s].
        acceleration: At its start and end [m/s^2].
    """

    side: float
    radius: float
    speed: float
    acceleration: float

    @property
    def profile(self) -> Profile:
        """Share of the way by time, from 0 to 1."""
        return replace(self._pace(rounded_square(np.zeros(3), self.side, self.radius)), theta=1.0)

    def plan(self, arm: StaticArm, start: Array, dt: float) -> AxisMotion:
        """Return the motion; the arm starts in the middle of the side towards +x."""
        here = arm.pose(start)
        way = rounded_square(here[:3, 3] - np.array([self.side / 2, 0.0, 0.0]), self.side, self.radius)
        profile = self._pace(way)
        return _along(arm, travel(way, here[:3, :3], profile, _times(profile.duration)), start, True)

    def _pace(self, way: Way) -> Trapezoid:
        return at_speed(way.length, self.speed, self.acceleration)


def read_move(section: Section) -> TaskMove:
    """Read one move of a task file.

    Raises:
        ConfigError: It is not exactly one of the kinds, or a value is wrong.
    """
    given = [kind for kind in _READERS if section.has(kind)]
    if len(given) != 1:
        raise section.error("", given, f"expected exactly one of {', '.join(_READERS)}")
    move = _READERS[given[0]](section)
    section.done()
    return move


def read_axes(section: Section) -> dict[str, float]:
    """Return positions by axis "joint.axis" [rad or m].

    Raises:
        ConfigError: There is none, a name is not of that form, or a value is wrong.
    """
    names = section.names(dots=True)
    if not names:
        raise section.error("", {}, "expected at least one axis, as 'joint.rz: 10 deg'")
    for name in names:
        joint, _, axis = name.rpartition(".")
        if not joint or axis not in AXES:
            allowed = f"expected the name of a joint, a dot and one of {', '.join(AXES)}"
            raise section.error(name, section.take(name), allowed)
    return {axis: section.quantity(axis, axis_dimension(axis, "position")) for axis in names}


def _read_by(section: Section) -> TaskMove:
    return ByAxes(read_axes(section.section("by")), _read_profile(section))


def _read_to(section: Section) -> TaskMove:
    return ToPose(section.text("to"), _read_profile(section))


def _read_shift(section: Section) -> TaskMove:
    keep = section.flag("keep_orientation")
    shift = section.quantities("shift", ["length"] * 3)
    if not shift.any():
        raise section.error("shift", section.take("shift"), "moves nothing; expected a way of the tip")
    return ShiftTip(shift, keep, _read_profile(section))


def _read_square(section: Section) -> TaskMove:
    inner = section.section("square")
    square = SquareTip(
        inner.quantity("side", "length", above=0.0),
        inner.quantity("radius", "length", above=0.0),
        inner.quantity("speed", "velocity", above=0.0),
        inner.quantity("acceleration", "acceleration", above=0.0),
    )
    try:
        _ = square.profile
    except ValueError as error:
        raise section.error("square", section.take("square"), str(error)) from None
    inner.done()
    return square


LONGEST = 3600.0  # s, of a move and of every wait
ROUNDING = 1e-12  # of a duration; two ramps may be all of it

_READERS: dict[str, Callable[[Section], TaskMove]] = {
    "by": _read_by,
    "to": _read_to,
    "shift": _read_shift,
    "square": _read_square,
}


def _read_profile(section: Section) -> Profile:
    """Return a trapezoid of velocity with two ramps, or without them a quintic, from 0 to 1."""
    duration = section.quantity("duration", "time", above=0.0)
    if not section.has("ramps"):
        return Quintic(1.0, duration)
    first, last = section.quantities("ramps", ["time"] * 2)
    if min(first, last) <= 0.0 or first + last > duration * (1.0 + ROUNDING):
        why = f"both must be > 0 s, together, {first + last:.6g} s, at most the duration, {duration:.6g} s"
        raise section.error("ramps", section.take("ramps"), why)
    return Trapezoid(1.0, duration, float(first), float(last))


def _straight(start: Array, way: Array, profile: Profile, dt: float) -> AxisMotion:
    t = np.append(np.arange(0.0, profile.duration - dt / 2, dt), profile.duration)
    share, rate, acceleration = (part[:, None] for part in profile.sample(t))
    acceleration[-1] = 0.0
    return AxisMotion(t, start + share * way, rate * way, acceleration * way)


def _times(duration: float) -> Array:
    return np.linspace(0.0, duration, max(round(duration / SAMPLE), 10) + 1)


def _along(arm: StaticArm, motion: CartesianMotion, start: Array, keep_orientation: bool) -> AxisMotion:
    try:
        joints = arm.follow(motion.poses, float(motion.t[1] - motion.t[0]), start, keep_orientation)
    except KinematicsError as error:
        raise ValueError(_where_it_ends(motion, error, start.size, keep_orientation)) from None
    at_rest = joints.theta_dot.copy()
    at_rest[[0, -1]] = 0.0
    return AxisMotion(motion.t, joints.theta, at_rest, joints.theta_ddot)


def _where_it_ends(motion: CartesianMotion, error: KinematicsError, axes: int, is_full: bool) -> str:
    """Return where on its way the tip cannot go on, and what is likely the reason."""
    steps = np.diff(motion.poses[: error.index + 1, :3, 3], axis=0)
    at = f"{np.linalg.norm(steps, axis=1).sum():.3g} m on, {motion.t[error.index]:.3g} s after its begin"
    few = f"; with so few axes, {axes}, only some ways can be followed" if axes < 3 + 3 * is_full else ""
    return f"the tip cannot follow its way from {at}{few}: {error}"
