"""The oracle is checked against what is older than it: textbooks, limits and seed 002, section 3."""

from __future__ import annotations

import numpy as np
import pytest
from beam_theory import BeamModes, cantilever, quadrature

WIDTH, THICKNESS, DENSITY = 0.020, 0.0032, 7750.0  # the strip of seed 002
RADIUS = 0.010  # of the clamp from the hub axis
AREA, INERTIA = WIDTH * THICKNESS, WIDTH * THICKNESS**3 / 12.0
TEXTBOOK_ROOTS = [1.8751041, 4.6940911, 7.8547574, 10.9955407]  # 1 + cos(x) cosh(x) = 0


def strip(E: float, length: float, mass: float, at: float, n: int = 3) -> BeamModes:
    rho = DENSITY
    return cantilever(E, INERTIA, rho * AREA, length, mass, at, n, rho * INERTIA, RADIUS)


def test_bare_beam_has_the_textbook_roots() -> None:
    modes = cantilever(2.1e11, INERTIA, DENSITY * AREA, 0.7, 0.0, 0.5, 4)
    roots = 0.7 * (DENSITY * AREA * modes.omega**2 / (2.1e11 * INERTIA)) ** 0.25
    np.testing.assert_allclose(roots, TEXTBOOK_ROOTS, rtol=1e-7)  # as many digits as are quoted


@pytest.mark.parametrize(
    ("E", "length", "mass", "at", "published"),
    [
        (210e9, 0.640, 0.0, 0.630, (6.569, 41.17, 115.3)),
        (210e9, 0.640, 0.054, 0.630, (5.101, 35.26, 103.4)),
        (210e9, 0.640, 0.054, 0.620, (5.148, 35.98, 105.9)),
        (210e9, 0.630, 0.054, 0.620, (5.249, 36.35, 106.7)),
        (208.5e9, 0.630, 0.054, 0.620, (5.230, 36.22, 106.3)),
    ],
)
def test_frequencies_of_seed_002_are_met_to_their_digits(
    E: float, length: float, mass: float, at: float, published: tuple[float, float, float]
) -> None:
    f_hz = strip(E, length, mass, at).omega / (2.0 * np.pi)
    assert np.all(np.abs(f_hz - published) < 0.51 * np.array([1e-3, 1e-2, 1e-1]))  # printed digits


def test_heavy_tip_mass_turns_the_beam_into_a_spring() -> None:
    modes = cantilever(2e11, INERTIA, DENSITY * AREA, 0.6, 50.0, 0.6, 1)
    carried = 50.0 + 33.0 / 140.0 * DENSITY * AREA * 0.6  # Rayleigh: static shape of a tip force
    spring = np.sqrt(3.0 * 2e11 * INERTIA / (carried * 0.6**3))
    assert modes.omega[0] == pytest.approx(spring, rel=1e-6)  # (beam mass / 50 kg)^2 is 4e-5


def test_shapes_are_orthonormal_in_the_mass() -> None:
    modes = strip(208.5e9, 0.630, 0.054, 0.620, n=5)
    beam = modes.shapes[0].beam
    x, weights = quadrature(beam)
    phi = np.array([s(x) for s in modes.shapes])
    slope = np.array([s(x, 1) for s in modes.shapes])
    at_mass = np.array([s(beam.at) for s in modes.shapes])
    gram = (phi * weights) @ phi.T * beam.rho_A + (slope * weights) @ slope.T * beam.rho_I
    np.testing.assert_allclose(gram + beam.mass * np.outer(at_mass, at_mass), np.eye(5), atol=1e-9)


def test_participation_from_the_root_reaction_is_the_integral_of_the_definition() -> None:
    radius = RADIUS
    modes = strip(208.5e9, 0.630, 0.054, 0.620, n=5)
    beam = modes.shapes[0].beam
    x, weights = quadrature(beam)
    for shape, value in zip(modes.shapes, modes.participation, strict=True):
        integral = weights @ (beam.rho_A * (radius + x) * shape(x) + beam.rho_I * shape(x, 1))
        integral += beam.mass * (radius + beam.at) * float(shape(beam.at))
        assert value == pytest.approx(integral, rel=1e-7)


def test_participation_at_the_sensor_is_that_of_seed_002() -> None:
    modes = strip(208.5e9, 0.630, 0.054, 0.620, n=4)
    seen = [g * float(s(0.620)) for g, s in zip(modes.participation, modes.shapes, strict=True)]
    np.testing.assert_allclose(seen, [0.6854, -0.0685, 0.0180, -0.0072], atol=0.6e-4)  # its digits


def test_participation_adds_up_to_the_rigid_radius() -> None:
    modes = strip(208.5e9, 0.630, 0.054, 0.620, n=8)
    seen = [g * float(s(0.620)) for g, s in zip(modes.participation, modes.shapes, strict=True)]
    assert sum(seen) == pytest.approx(0.630, abs=2e-3)  # the alternating tail of mode 9


def test_derivatives_of_a_shape_are_its_finite_differences() -> None:
    shape = strip(208.5e9, 0.630, 0.054, 0.4).shapes[2]
    x, h = np.array([0.1, 0.35, 0.45, 0.6]), 1e-5
    for order in range(3):
        difference = (shape(x + h, order) - shape(x - h, order)) / (2.0 * h)
        np.testing.assert_allclose(shape(x, order + 1), difference, rtol=1e-6)
