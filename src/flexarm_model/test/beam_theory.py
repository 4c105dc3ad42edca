"""Exact modes of a clamped Euler-Bernoulli beam with a point mass: the oracle of the beam tests.

Closed form, no mesh. With rotary inertia the shape obeys::

    E I w'''' + omega^2 rho_I w'' - omega^2 rho_A w = 0
    w = w' = 0 at the clamp;   w'' = 0, E I w''' + omega^2 rho_I w' = 0 at the tip
    E I [w'''] = omega^2 mass w  across the point mass

Solutions that meet the clamp are spanned by two functions; the point mass adds the response to
a unit jump of ``w'''``; the two tip conditions leave a 2x2 determinant in ``omega``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

Array = NDArray[np.float64]

SCAN_STEP = 0.02  # of (rho_A omega^2 / E I)^(1/4) L; roots are more than 1 apart
QUADRATURE_POINTS = 80  # Gauss-Legendre on each side of the mass; exact to rounding for 10 modes


@dataclass(frozen=True)
class Cantilever:
    """Uniform clamped-free beam with one point mass.

    Attributes:
        EI: Bending stiffness [N m^2].
        rho_A: Mass per length [kg/m].
        rho_I: Rotary inertia per length [kg m].
        length: Free length [m].
        mass: Point mass [kg].
        at: Its distance from the clamp [m].
    """

    EI: float
    rho_A: float
    rho_I: float
    length: float
    mass: float
    at: float


@dataclass(frozen=True)
class Shape:
    """One mode shape, mass normalised and positive at the tip [kg^-1/2]."""

    beam: Cantilever
    omega: float
    coefficients: Array  # (2,)

    def __call__(self, x: ArrayLike, order: int = 0) -> Array:
        """Return the derivative of the given order at distances ``x`` [m] from the clamp."""
        return _derivatives(self.beam, self.omega, np.asarray(x, dtype=float), order) @ self.coefficients


class BeamModes(NamedTuple):
    """Frequencies [rad/s] (n,), shapes, and participation in a hub rotation [kg^1/2 m] (n,)."""

    omega: Array
    shapes: tuple[Shape, ...]
    participation: Array


def cantilever(
    E: float,
    I: float,  # noqa: E741 - second moment of area has this name
    rho_A: float,
    length: float,
    mass: float,
    at: float,
    n: int,
    rho_I: float = 0.0,
    radius: float = 0.0,
) -> BeamModes:
    """Return the first ``n`` modes.

    The participation of a mode is the factor of a hub acceleration about an axis that lies
    ``radius`` before the clamp: ``q'' + omega^2 q = -participation theta''``. A point at x then
    feels ``participation * shape(x)`` metres per unit of it; over all modes these add up to
    ``radius + x``.

    Args:
        E: Young's modulus [Pa].
        I: Second moment of area [m^4].
        rho_A: Mass per length [kg/m].
        length: Free length [m].
        mass: Point mass [kg].
        at: Its distance from the clamp [m].
        n: Number of modes.
        rho_I: Rotary inertia per length [kg m].
        radius: Distance from the hub axis to the clamp [m].
    """
    beam = Cantilever(E * I, rho_A, rho_I, length, mass, at)
    omega = np.array(_frequencies(beam, n))
    shapes = tuple(_shape(beam, w) for w in omega)
    reactions = [beam.EI * (s(0.0, 2) - radius * s(0.0, 3)) for s in shapes]
    return BeamModes(omega, shapes, np.array(reactions) / omega**2)


def quadrature(beam: Cantilever) -> tuple[Array, Array]:
    """Return points [m] and weights [m] that integrate along the beam, split at the mass."""
    nodes, weights = np.polynomial.legendre.leggauss(QUADRATURE_POINTS)
    edges = np.array([0.0, beam.at, beam.length])
    half, middle = np.diff(edges) / 2.0, (edges[1:] + edges[:-1]) / 2.0
    return (middle[:, None] + half[:, None] * nodes).ravel(), (half[:, None] * weights).ravel()


def _wave_numbers(beam: Cantilever, omega: float) -> tuple[float, float]:
    a, b = beam.rho_I * omega**2 / beam.EI, beam.rho_A * omega**2 / beam.EI
    root = np.sqrt(a * a + 4.0 * b)
    return float(np.sqrt((root - a) / 2.0)), float(np.sqrt((root + a) / 2.0))


def _hyperbolic(k: float, x: Array, order: int, odd: bool) -> Array:
    return k**order * (np.sinh(k * x) if odd != bool(order % 2) else np.cosh(k * x))


def _circular(k: float, x: Array, order: int, odd: bool) -> Array:
    phase = order * np.pi / 2.0 - (np.pi / 2.0 if odd else 0.0)
    return k**order * np.cos(k * x + phase)


def _derivatives(beam: Cantilever, omega: float, x: Array, order: int) -> Array:
    """Return the two clamped solutions, the mass included, at ``x``: (..., 2)."""
    p, q = _wave_numbers(beam, omega)

    def clamped(at: Array, d: int) -> Array:
        even = _hyperbolic(p, at, d, False) - _circular(q, at, d, False)
        odd = _hyperbolic(p, at, d, True) / p - _circular(q, at, d, True) / q
        return np.stack([even, odd], axis=-1)

    behind = np.maximum(x - beam.at, 0.0)
    jump = _hyperbolic(p, behind, order, True) / p - _circular(q, behind, order, True) / q
    jump = np.where(x >= beam.at, jump, 0.0) / (p * p + q * q)
    kick = omega**2 * beam.mass / beam.EI * clamped(np.asarray(beam.at), 0)
    return clamped(x, order) + jump[..., None] * kick


def _tip_conditions(beam: Cantilever, omega: float) -> Array:
    tip = np.asarray(beam.length)
    moment = _derivatives(beam, omega, tip, 2)
    shear = _derivatives(beam, omega, tip, 3)
    shear = shear + omega**2 * beam.rho_I / beam.EI * _derivatives(beam, omega, tip, 1)
    conditions = np.stack([moment, shear])  # (2, 2)
    return np.asarray(conditions / np.abs(conditions).max(axis=1, keepdims=True))


def _frequencies(beam: Cantilever, n: int) -> list[float]:
    scale = np.sqrt(beam.EI / beam.rho_A) / beam.length**2

    def determinant(wave: float) -> float:
        return float(np.linalg.det(_tip_conditions(beam, wave**2 * scale)))

    found: list[float] = []
    low, at_low = SCAN_STEP, determinant(SCAN_STEP)
    while len(found) < n:
        high = low + SCAN_STEP
        at_high = determinant(high)
        if at_low * at_high < 0.0:
            found.append(brentq(determinant, low, high, xtol=1e-14, rtol=1e-14) ** 2 * scale)
        low, at_low = high, at_high
    return found


def _shape(beam: Cantilever, omega: float) -> Shape:
    coefficients = np.linalg.svd(_tip_conditions(beam, omega))[2][-1]
    raw = Shape(beam, omega, coefficients)
    x, weights = quadrature(beam)
    modal_mass = weights @ (beam.rho_A * raw(x) ** 2 + beam.rho_I * raw(x, 1) ** 2)
    modal_mass += beam.mass * float(raw(beam.at)) ** 2
    sign = np.sign(raw(beam.length))
    return Shape(beam, omega, sign * coefficients / np.sqrt(modal_mass))
