"""Exact frequencies of Timoshenko's cantilever with a mass at its end: the oracle of the tests of shear.

No mesh: deflection w, rotation r, moment M and shear force V of a uniform beam that swings with omega obey::

    w' = r + V / kappa G A    r' = M / E I    M' = -V - omega^2 rho I r    V' = -omega^2 rho A w
    w = r = 0 at the clamp;   M = 0, V = omega^2 m w at the tip

The matrix exponential over the length is their solution; a determinant of 2 x 2 has the roots.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.optimize import brentq

STEP = 0.02  # of (rho A omega^2 L^4 / E I)^(1/4); roots are farther apart


@dataclass(frozen=True)
class Tube:
    """A round tube of aluminium with a mass at its end.

    Attributes:
        length, outer, inner: Length and diameters [m].
        mass: At its end [kg].
        kappa: Its shear coefficient; inf without shear.
    """

    length: float
    outer: float
    inner: float
    mass: float
    kappa: float
    E: float = 70e9
    G: float = 70e9 / 2.6
    density: float = 2700.0

    @property
    def area(self) -> float:
        """Of the section [m^2]."""
        return float(np.pi * (self.outer**2 - self.inner**2) / 4)

    @property
    def I(self) -> float:  # noqa: E743
        """Second moment of the section [m^4]."""
        return float(np.pi * (self.outer**4 - self.inner**4) / 64)

    def omega(self, count: int) -> NDArray[np.float64]:
        """Return the slowest angular frequencies [rad/s], (count,)."""
        scale = np.sqrt(self.E * self.I / (self.density * self.area)) / self.length**2
        found: list[float] = []
        low = STEP
        while len(found) < count:
            if self._determinant(scale * low**2) * self._determinant(scale * (low + STEP) ** 2) < 0:
                root = brentq(lambda k: self._determinant(scale * k**2), low, low + STEP, xtol=1e-12)
                found.append(scale * root**2)
            low += STEP
        return np.array(found)

    def _determinant(self, omega: float) -> float:
        square, EI, L = omega**2, self.E * self.I, self.length
        load = EI / L**2  # of force: all four are of like size over it and the length
        system = np.zeros((4, 4))  # of [w / L, r, M L / EI, V / load] over x / L
        system[0, 1], system[0, 3] = 1.0, load / (self.kappa * self.G * self.area)
        system[1, 2] = 1.0
        system[2, 3], system[2, 1] = -1.0, -square * self.density * self.I * L**2 / EI
        system[3, 0] = -square * self.density * self.area * L**4 / EI
        end = expm(system)
        heavy = end[3] - square * self.mass * L / load * end[0]
        return float(end[2, 2] * heavy[3] - end[2, 3] * heavy[2])
