"""A number of a description that is to be fitted, and the equal numbers that go with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Unknown:
    """A parameter to fit.

    Attributes:
        path: Dotted path in the description.
        number: Its value there, in its own unit.
        unit: That unit; empty for a plain number.
        spread: One sigma of its relative error before the measurement [1].
        part: What the part of the arm that holds it is, as text; equal for equal parts.
        equals: Paths of the same number in equal parts, which changes with it.
    """

    path: str
    number: float
    unit: str
    spread: float
    part: str = ""
    equals: tuple[str, ...] = ()

    @property
    def paths(self) -> tuple[str, ...]:
        """All numbers that it stands for."""
        return (self.path, *self.equals)

    @property
    def name(self) -> str:
        """Its path; of equal parts their names with commas between: ``bodies.leg_1,leg_2.damping_ratio``."""
        levels = zip(*(path.split(".") for path in self.paths), strict=True)
        return ".".join(",".join(dict.fromkeys(level)) for level in levels)

    def text(self, x: float) -> str | float:
        """Return the value at ``p_0 exp(x)`` as the description writes it."""
        value = float(f"{self.number * np.exp(x):.9g}")
        return f"{value:.9g} {self.unit}" if self.unit else value


def changed(unknowns: Sequence[Unknown], x: Array) -> dict[str, str | float]:
    """Return the values of all paths at ``p_0 exp(x)``, as ``load_config`` takes them."""
    return {path: unknown.text(at) for unknown, at in zip(unknowns, x, strict=True) for path in unknown.paths}
