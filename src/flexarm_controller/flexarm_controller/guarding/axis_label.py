"""How the guard's messages name an axis and its unit; read only when there is something to say."""

from __future__ import annotations

from typing import NamedTuple


class AxisLabel(NamedTuple):
    """An axis in words.

    Attributes:
        name: What it is called, "axis 2 (shoulder.rz)".
        unit: Of its position, "rad" or "m"; empty where nobody knows.
    """

    name: str
    unit: str

    def position(self, value: float, digits: int = 3) -> str:
        """Return a position, or a way, with its unit."""
        return f"{value:.{digits}g} {self.unit}" if self.unit else f"{value:.{digits}g}"

    def velocity(self, value: float) -> str:
        """Return a velocity with its unit."""
        return f"{value:.3g} {self.unit}/s" if self.unit else f"{value:.3g}"


def number_axis(axis: int) -> AxisLabel:
    """Return the label of an axis of which only the place is known, from 0."""
    return AxisLabel(f"axis {axis + 1}", "")
