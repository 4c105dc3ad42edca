"""What the arm asks of its motors near a pose: the torque that holds it, and its inertia.

h(q) = holding + stiffness (q - pose)          tau = h + inertia a
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
        reach: Distance from the pose up to which they are good [rad] or [m].
    """

    pose: Row
    holding: Row
    stiffness: tuple[Row, ...]
    inertia: tuple[Row, ...]
    reach: Row

    def fits(self, axes: int) -> bool:
        """Tell whether these are finite loads of so many axes."""
        square = len(self.stiffness) == len(self.inertia) == axes
        rows = (self.pose, self.holding, self.reach, *self.stiffness, *self.inertia)
        return square and all(len(row) == axes and all(map(math.isfinite, row)) for row in rows)

    def holding_at(self, position: Sequence[float]) -> list[float]:
        """Return the holding torque at a position [N m] or [N]; an axis that tells none counts as there."""
        known = position if len(position) == len(self.pose) else self.pose
        away = [_within(q - q_0, most) for q, q_0, most in zip(known, self.pose, self.reach, strict=True)]
        return [h + product(row, away) for h, row in zip(self.holding, self.stiffness, strict=True)]

    def accelerating(self, acceleration: Sequence[float]) -> list[float]:
        """Return the torque that accelerates the arm [N m] or [N]."""
        return [product(row, acceleration) for row in self.inertia]


def product(row: Sequence[float], column: Sequence[float]) -> float:
    """Return the scalar product."""
    return sum([a * b for a, b in zip(row, column, strict=True)])


def _within(value: float, most: float) -> float:
    return 0.0 if math.isnan(value) else max(-most, min(most, value))
