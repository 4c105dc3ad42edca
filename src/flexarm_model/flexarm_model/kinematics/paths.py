"""Paths of the tip: where it is along the way, and when.

A path gives position and its first two derivatives by the length of the way s; a profile of
`flexarm_model.motion.profiles` gives s(t). Straight lines and arcs of circles are put together to polygons
with rounded corners. On an arc of radius r at speed v the acceleration jumps to v^2 / r.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy
from numpy.typing import NDArray

from flexarm_model.motion.profiles import Profile, Trapezoid
from flexarm_model.numeric.rotation import rotation_vector

Array = NDArray[np.float64]


@dataclass(frozen=True)
class CartesianMotion:
    """A motion of the tip, sampled.

    Attributes:
        t: Times [s], (k,).
        poses: ``T_world_tip``, (k, 4, 4).
        twists: Velocity [m/s] and angular velocity [rad/s], world axes, (k, 6).
        accelerations: Their derivatives [m/s^2, rad/s^2], (k, 6).
    """

    t: Array
    poses: Array
    twists: Array
    accelerations: Array


class Piece(Protocol):
    """A piece of the way."""

    @property
    def length(self) -> float:
        """Length [m]."""
        ...

    def at(self, s: Array) -> tuple[Array, Array, Array]:
        """Return position [m], direction [1] and curvature vector [1/m] at s [m], each (k, 3)."""
        ...


@dataclass(frozen=True)
class Line:
    """A straight piece.

    Attributes:
        start: First point [m], (3,).
        direction: Unit vector, (3,).
        length: Length [m].
    """

    start: Array
    direction: Array
    length: float

    def at(self, s: Array) -> tuple[Array, Array, Array]:
        """Return position, direction and curvature vector at s [m], each (k, 3)."""
        along = np.multiply.outer(s, self.direction)
        return self.start + along, np.broadcast_to(self.direction, along.shape), np.zeros_like(along)


@dataclass(frozen=True)
class Arc:
    """An arc of a circle.

    Attributes:
        centre: Of the circle [m], (3,).
        outward: Unit vector from the centre to the first point, (3,).
        direction: Unit vector of the way at the first point, (3,).
        radius: Radius [m].
        angle: How far it turns [rad].
    """

    centre: Array
    outward: Array
    direction: Array
    radius: float
    angle: float

    @property
    def length(self) -> float:
        """Length [m]."""
        return self.radius * self.angle

    def at(self, s: Array) -> tuple[Array, Array, Array]:
        """Return position, direction and curvature vector at s [m], each (k, 3)."""
        c, sine = np.cos(s / self.radius), np.sin(s / self.radius)
        out = np.multiply.outer(c, self.outward) + np.multiply.outer(sine, self.direction)
        way = np.multiply.outer(c, self.direction) - np.multiply.outer(sine, self.outward)
        return self.centre + self.radius * out, way, -out / self.radius


@dataclass(frozen=True)
class Way:
    """Pieces, one after the other."""

    pieces: tuple[Piece, ...]

    @property
    def length(self) -> float:
        """Length [m]."""
        return sum(piece.length for piece in self.pieces)

    def at(self, s: Array) -> tuple[Array, Array, Array]:
        """Return position, direction and curvature vector at s [m], each (k, 3); s is clipped."""
        starts = np.concatenate([[0.0], np.cumsum([piece.length for piece in self.pieces])])
        index = np.clip(np.searchsorted(starts, s, side="right") - 1, 0, len(self.pieces) - 1)
        result = tuple(np.zeros((len(s), 3)) for _ in range(3))
        for i, piece in enumerate(self.pieces):
            here = index == i
            values = piece.at(np.clip(s[here] - starts[i], 0.0, piece.length))
            for all_, some in zip(result, values, strict=True):
                all_[here] = some
        return result[0], result[1], result[2]


def rounded_square(centre: Array, side: float, radius: float) -> Way:
    """Return a horizontal square with rounded corners, counter-clockwise from the middle of its +x side.

    Args:
        centre: Centre [m], (3,).
        side: Length of the sides before rounding [m].
        radius: Of the corners [m]; above 0, at most half the side.

    Raises:
        ValueError: The corners do not fit.
    """
    if not 0.0 < radius <= side / 2.0:
        raise ValueError(f"corner radius {radius} m must be above 0 and at most {side / 2.0} m")
    half, straight = side / 2.0, side - 2.0 * radius
    pieces: list[Piece] = []
    for k in range(4):
        out = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]][k])
        way = np.array([-out[1], out[0], 0.0])
        corner = centre + (half - radius) * (out + way)
        pieces += [
            Line(centre + half * out, way, straight / 2.0),
            Arc(corner, out, way, radius, math.pi / 2.0),
            Line(corner + radius * way, -out, straight / 2.0),
        ]
    return Way(tuple(piece for piece in pieces if piece.length > 0.0))


def at_speed(length: float, speed: float, acceleration: float) -> Trapezoid:
    """Return the profile from rest to rest over a length [m] at constant speed [m/s] but for both ends.

    Raises:
        ValueError: The length is too short to reach the speed with that acceleration [m/s^2].
    """
    ramp = speed / acceleration
    return Trapezoid(length, length / speed + ramp, ramp, ramp)


def travel(way: Way, R: Array, profile: Profile, t: Array) -> CartesianMotion:
    """Return the motion along a way with constant orientation.

    Args:
        way: The way.
        R: Orientation of the tip, (3, 3).
        profile: Length of the way by time; it ends at ``way.length`` [m].
        t: Times [s], (k,).
    """
    s, speed, push = (values[:, None] for values in profile.sample(t))
    position, direction, curvature = way.at(s[:, 0])
    still = np.zeros_like(position)
    velocity, acceleration = direction * speed, direction * push + curvature * speed**2
    return _motion(t, position, np.broadcast_to(R, (len(s), 3, 3)),
                   np.hstack([velocity, still]), np.hstack([acceleration, still]))  # fmt: skip


def straight_move(start: Array, end: Array, profile: Profile, t: Array) -> CartesianMotion:
    """Return a straight move from pose to pose that turns about one fixed axis.

    Args:
        start: First pose, (4, 4).
        end: Last pose, (4, 4).
        profile: From 0 to 1, position and rotation alike.
        t: Times [s], (k,).
    """
    share, rate, rate_dot = (values[:, None] for values in profile.sample(t))
    way = end[:3, 3] - start[:3, 3]
    turn = rotation_vector(end[:3, :3] @ start[:3, :3].T)
    twist = np.concatenate([way, turn])
    R = np.asarray(scipy.spatial.transform.Rotation.from_rotvec(share * turn).as_matrix()) @ start[:3, :3]
    return _motion(t, start[:3, 3] + share * way, R, rate * twist, rate_dot * twist)


def _motion(t: Array, position: Array, R: Array, twists: Array, accelerations: Array) -> CartesianMotion:
    poses = np.zeros((len(position), 4, 4))
    poses[:, :3, :3], poses[:, :3, 3], poses[:, 3, 3] = R, position, 1.0
    return CartesianMotion(np.atleast_1d(np.asarray(t, dtype=float)), poses, twists, accelerations)
