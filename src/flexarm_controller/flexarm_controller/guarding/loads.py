"""What the arm asks of its motors near a pose: the torque that holds it, turns it evenly and accelerates it.

h(q) = holding + stiffness (q - pose)     c(v) = sum_j<=k turning_jk v_j v_k
tau = h + c + slowing v + inertia a

Friction D slows each axis by ``D_jj v_j / M_jj`` on top of a, which would pull at the other axes;
``slowing = D - M diag(D_jj / M_jj)`` cancels that. No axis is pushed against its own friction.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

Row = tuple[float, ...]


@dataclass(frozen=True)
class Loads:
    """Loads about a pose; one value per axis.

    Attributes:
        pose: Positions of the axes [rad] or [m].
        holding: Torque [N m] or force [N] that holds the arm there.
        stiffness: By how much it changes per position, row by row [N m/rad].
        inertia: Torque per acceleration, row by row [kg m^2] or [kg].
        turning: Centripetal and Coriolis torque per product of two velocities, row by row, in the order
            11, 12, .. 22, .. [kg m^2].
        slowing: Torque per velocity of another axis that friction brakes, row by row [N m s/rad].
        reach: Distance from the pose up to which they are good [rad] or [m].
        fastest: Velocity up to which they are good; inf for any [rad/s] or [m/s].
        rate: With which the arm may be held there, see ``hold_rate``; inf for any [1/s].
    """

    pose: Row
    holding: Row
    stiffness: tuple[Row, ...]
    inertia: tuple[Row, ...]
    turning: tuple[Row, ...]
    slowing: tuple[Row, ...]
    reach: Row
    fastest: Row
    rate: float = math.inf

    def fits(self, axes: int) -> bool:
        """Tell whether these are finite loads of so many axes, each of which has inertia."""
        tables = (self.stiffness, self.inertia, self.slowing, self.turning)
        square = all(len(table) == axes for table in (*tables, self.fastest))
        rows = (self.pose, self.holding, self.reach, *self.stiffness, *self.inertia, *self.slowing)
        return (
            square
            and all(_is_finite(row, axes) for row in rows)
            and all(_is_finite(row, axes * (axes + 1) // 2) for row in self.turning)
            and all(row[axis] > 0.0 for axis, row in enumerate(self.inertia))
            and not any(map(math.isnan, self.fastest))
            and self.rate > 0.0
        )

    def holding_at(self, position: Sequence[float]) -> list[float]:
        """Return the holding torque at a position [N m] or [N]; an axis that tells none counts as there."""
        known = position if len(position) == len(self.pose) else self.pose
        away = [_within(q - q_0, most) for q, q_0, most in zip(known, self.pose, self.reach, strict=True)]
        return [h + product(row, away) for h, row in zip(self.holding, self.stiffness, strict=True)]

    def even(self, velocity: Sequence[float]) -> list[float]:
        """Return the torque that keeps the axes at their velocities [N m] or [N].

        Args:
            velocity: That is told [rad/s] or [m/s]; what is not a number turns nothing.
        """
        known = [_within(v, most) for v, most in zip(velocity, self.fastest, strict=True)]
        pairs = [v * w for j, v in enumerate(known) for w in known[j:]]
        return [
            _within(product(turning, pairs) + product(slowing, known), math.inf)
            for turning, slowing in zip(self.turning, self.slowing, strict=True)
        ]

    def changing(self, acceleration: Sequence[float]) -> list[float]:
        """Return the torque that accelerations of the axes [rad/s^2] or [m/s^2] take beyond that."""
        return [product(row, acceleration) for row in self.inertia]


def product(row: Sequence[float], column: Sequence[float]) -> float:
    """Return the scalar product."""
    return sum([a * b for a, b in zip(row, column, strict=True)])


def _is_finite(row: Row, length: int) -> bool:
    return len(row) == length and all(map(math.isfinite, row))


def _within(value: float, most: float) -> float:
    return 0.0 if math.isnan(value) else max(-most, min(most, value))
