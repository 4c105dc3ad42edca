"""Series of rest-to-rest moves of one axis, out and back, as one reference.

The arm moves out by the angle on one profile, waits, comes back on another, waits, and so on. Each move
has its own slot of time, in which its residual vibration and settling are read.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.reference import Reference
from flexarm_model.motion.profiles import Profile, Trapezoid
from flexarm_model.motion.shapers import shape, zvd

Array = NDArray[np.float64]

MOVE_TIME = 1.0  # s, every published motion (seed 002, table 1)
WAIT = 2.6  # s after each move
WATCH = (
    2.2  # s of these in which it is judged; a controller with preview starts on the next one before its time
)
LEAD = 0.5  # s before the first move, in which the estimator settles
PUBLISHED_F1_HZ = 5.23  # the frequency that the published motions were designed for (seed 002)

ProfileMaker = Callable[[float], Profile]


@dataclass(frozen=True)
class Move:
    """One rest-to-rest move.

    Attributes:
        motion: Name of its profile, as in ``MOTIONS``.
        angle: Its size, always positive [rad].
        origin: Where it starts [rad].
        sign: +1 out, -1 back.
        start: When it starts [s].
        profile: From 0 to ``angle``.
    """

    motion: str
    angle: float
    origin: float
    sign: int
    start: float
    profile: Profile

    @property
    def end(self) -> float:
        """End of the motion [s]."""
        return self.start + self.profile.duration

    @property
    def goal(self) -> float:
        """Where it ends [rad]."""
        return self.origin + self.sign * self.angle

    @property
    def watch_end(self) -> float:
        """Until when it is judged [s]."""
        return self.end + WATCH

    @property
    def slot_end(self) -> float:
        """When the next move may start [s]."""
        return self.end + WAIT


def motions(zeta: float) -> dict[str, ProfileMaker]:
    """Return the motions by name: the worst and best published trapezoid and a ZVD shaper, all of 1 s.

    Args:
        zeta: Damping ratio that the shaper counts on [1].
    """
    shaper = zvd(2 * np.pi * PUBLISHED_F1_HZ, zeta)

    def published(case: str) -> ProfileMaker:
        """Return what makes a published trapezoid of any angle."""
        return lambda angle: Trapezoid.published(case, angle, 1 / PUBLISHED_F1_HZ)

    return {
        "A": published("A"),
        "B": published("B"),
        "ZVD": lambda angle: shape(published("A")(angle), shaper).stretched(MOVE_TIME),
    }


def out_and_back(
    angles: Sequence[float], out: str, back: str, makers: dict[str, ProfileMaker]
) -> tuple[Move, ...]:
    """Return the moves out on one motion and back on another, for every angle [rad]."""
    moves: list[Move] = []
    start = LEAD
    for angle in angles:
        for motion, origin, sign in ((out, 0.0, 1), (back, angle, -1)):
            moves.append(Move(motion, angle, origin, sign, start, makers[motion](angle)))
            start = moves[-1].slot_end
    return tuple(moves)


def sample_moves(moves: Sequence[Move], times: Array) -> tuple[Array, Array, Array]:
    """Return position, velocity and acceleration of the series at ``times``, (k,) each."""
    theta = np.full(times.size, moves[0].origin)
    theta_dot, theta_ddot = np.zeros(times.size), np.zeros(times.size)
    for move in moves:
        inside = times >= move.start
        angle, rate, acceleration = move.profile.sample(times[inside] - move.start)
        theta[inside] = move.origin + move.sign * angle
        theta_dot[inside], theta_ddot[inside] = move.sign * rate, move.sign * acceleration
    return theta, theta_dot, theta_ddot


def reference_of(moves: Sequence[Move], dt: float) -> Reference:
    """Return the series as a reference of a one-axis arm, sampled every ``dt`` [s]."""
    times = np.asarray(np.arange(round(moves[-1].end / dt) + 2) * dt, dtype=np.float64)
    return Reference(times, *(column[:, None] for column in sample_moves(moves, times)))
