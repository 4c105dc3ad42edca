"""Superelements against a volume integral over the exact beam: no mesh, no shape functions.

The body is a bar that bends both ways, twists and stretches, with a mass at its end; its modes are known in
closed form and decouple. The integrals are taken over a three-dimensional Gauss grid of that body.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from arms import BAR, HEIGHT, WIDTH, bar, tip_mass
from beam_theory import cantilever
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.optimize import brentq

from flexarm_model.bodies.body_reduction import reduce_body
from flexarm_model.bodies.superelement import Superelement, pairs
from flexarm_model.manipulator.body_spec import Reduction, RigidBody

L, RHO = BAR.length, BAR.density
TIP = 0.2  # mass at the end [kg]
KINDS = ("bend_y", "bend_z", "torsion", "stretch")
N = 12  # modes: five or six of bend_y, four of bend_z, one or two of torsion and of stretch
J = 2e-11  # torsion constant: soft enough that these modes twist, too [m^4]


Array = NDArray[np.float64]
Integrals = tuple[Array, Array]  # s and P
Field = Callable[[Array, Array, Array], Array]


class Mode:
    """One exact mode: frequency and displacement of the point (x, y, z), (3, ...)."""

    def __init__(self, omega: float, field: Field, slope: Array, twist: Array) -> None:
        self.omega, self.field = omega, field
        self.slope, self.twist = slope, twist  # of uy and uz, and of the section, over X: (2, n_x), (n_x,)


X = np.linspace(0.0, L, 20001)
ZERO = np.zeros_like(X)


def bending(axis: int, I: float) -> list[Mode]:  # noqa: E741
    modes = cantilever(BAR.E, I, RHO * BAR.area, L, TIP, L, 7, rho_I=RHO * I)
    found = []
    for omega, shape in zip(modes.omega, modes.shapes, strict=True):

        def field(x: Array, y: Array, z: Array, shape=shape) -> Array:  # type: ignore[no-untyped-def]
            u = np.zeros((3, *np.broadcast(x, y, z).shape))
            u[0] = -(y if axis == 1 else z) * shape(x, 1)
            u[axis] = shape(x)
            return u

        slope = np.zeros((2, X.size))
        slope[axis - 1] = shape(X, 1)
        found.append(Mode(float(omega), field, slope, ZERO))
    return found


def rod(speed: float, inertia: float, mass: float, twist: bool) -> list[Mode]:
    """Return waves in a rod: per length ``inertia``, with ``mass`` at the end."""
    found = []
    for n in range(2):
        low, high = n * np.pi + 1e-9, (n + 0.5) * np.pi + 1e-9
        alpha = brentq(lambda a: a * np.sin(a) * mass - inertia * L * np.cos(a), low, high, xtol=1e-14)
        norm = inertia * L / 2 * (1 - np.sin(2 * alpha) / (2 * alpha)) + mass * np.sin(alpha) ** 2
        scale = 1 / np.sqrt(norm)

        def field(x: Array, y: Array, z: Array, alpha=alpha, scale=scale) -> Array:  # type: ignore[no-untyped-def]
            w = scale * np.sin(alpha * x / L)
            flat = 0 * (x + y + z)
            return np.stack([flat, -z * w, y * w] if twist else [w + flat, flat, flat])

        turns = scale * np.sin(alpha * X / L) if twist else ZERO
        found.append(Mode(alpha / L * speed, field, np.zeros((2, X.size)), turns))
    return found


@pytest.fixture(scope="module")
def modes() -> list[Mode]:
    J_p = BAR.I_y + BAR.I_z
    torsion = rod(np.sqrt(BAR.G * J / (RHO * J_p)), RHO * J_p, 0.0, True)
    stretch = rod(np.sqrt(BAR.E / RHO), RHO * BAR.area, TIP, False)
    found = bending(1, BAR.I_z) + bending(2, BAR.I_y) + torsion + stretch
    return sorted(found, key=lambda mode: mode.omega)[:N]


@pytest.fixture(scope="module")
def body() -> Superelement:
    beam = bar(KINDS, elements=64, torsion_constant=J, point_masses=tip_mass(TIP))
    beam = replace(beam, reduction=Reduction("craig_bampton", N, "clamped"))
    return reduce_body(replace(beam, nodes={**beam.nodes, "middle": 0.3}), {"root"})


def integrals(modes: list[Mode], signs: Array) -> Integrals:
    """Return s and P of the exact body by Gauss quadrature over its volume."""
    point, weight = np.polynomial.legendre.leggauss(60)
    x, wx = (point + 1) * L / 2, weight * L / 2
    point, weight = np.polynomial.legendre.leggauss(2)
    y, z = point * WIDTH / 2, point * HEIGHT / 2
    X3, Y3, Z3 = np.meshgrid(x, y, z, indexing="ij")
    dm = RHO * np.einsum("i,j,k->ijk", wx, weight * WIDTH / 2, weight * HEIGHT / 2).ravel()
    points = [np.append(a.ravel(), b) for a, b in ((X3, L), (Y3, 0.0), (Z3, 0.0))]
    dm = np.append(dm, TIP)
    fields = [np.stack(points)] + [
        sign * mode.field(*points) for sign, mode in zip(signs, modes, strict=True)
    ]
    for i, j in pairs(len(modes)):
        sign = signs[i] * signs[j]
        second = sign * np.stack([_shortening(modes[i], modes[j]), *_turned(modes[i], modes[j])])
        fields.append(np.stack([np.interp(points[0], X, component) for component in second]))
    N_all = np.stack(fields)  # (n_f, 3, k)
    return np.einsum("aik,k->ai", N_all, dm), np.einsum("aik,bjk,k->abij", N_all, N_all, dm, optimize=True)


def _shortening(one: Mode, other: Mode) -> Array:
    return np.asarray(-cumulative_trapezoid((one.slope * other.slope).sum(axis=0), X, initial=0.0))


def _turned(one: Mode, other: Mode) -> Array:
    """Return along y and z what twist makes of bending: ``int int -rx uz''`` and ``int int rx uy''``."""
    bent = one.twist * np.gradient(other.slope, X, axis=1) + other.twist * np.gradient(one.slope, X, axis=1)
    twice = cumulative_trapezoid(cumulative_trapezoid(bent, X, initial=0.0), X, initial=0.0)
    return np.stack([-twice[1], twice[0]])


@pytest.fixture(scope="module")
def oracle(body: Superelement, modes: list[Mode]) -> Integrals:
    """Return the exact integrals, each mode with the sign that the superelement gave it."""
    point = [np.array([v]) for v in (L, WIDTH, HEIGHT)]
    exact = np.array([mode.field(*point)[:, 0] for mode in modes])
    end = body.nodes["end"]
    turned = np.cross(end.Psi.T, [0.0, WIDTH, HEIGHT])
    signs = np.sign(np.einsum("ai,ai->a", exact, end.Phi.T + turned))
    return integrals(modes, signs)


def test_frequencies_are_those_of_the_exact_body(body: Superelement, modes: list[Mode]) -> None:
    # linear elements twist with an error of (k h)^2 / 24; k h = 3 pi / 2 / 64 for the second mode
    assert body.omega == pytest.approx([mode.omega for mode in modes], rel=2.5e-4)


def test_first_moments_are_volume_integrals(body: Superelement, oracle: Integrals) -> None:
    s, P = oracle
    bound = np.sqrt(np.einsum("aaii->a", P) * body.mass)[:, None]  # Cauchy-Schwarz
    assert (abs(body.s - s) <= 1e-4 * bound).all()  # as the frequencies


def test_second_moments_are_volume_integrals(body: Superelement, oracle: Integrals) -> None:
    _, P = oracle
    size = np.sqrt(np.einsum("aaii->a", P))
    assert (abs(body.P - P) <= 2e-4 * (size[:, None] * size)[:, :, None, None]).all()


def test_what_nothing_couples_is_exactly_zero(body: Superelement) -> None:
    """A mode bends one way or the other; rounding in between would double the generated code."""
    end = body.nodes["end"]
    moves = np.vstack([end.Phi, end.Psi[:1]]) != 0
    assert (moves.sum(axis=0) == 1).all() and moves.any(axis=1).all()


def test_a_round_tube_has_modes_along_its_axes() -> None:
    square = replace(BAR, I_y=BAR.I_z, elements=8)
    beam = replace(bar(("bend_y", "bend_z")), pieces=(square,))
    Phi = reduce_body(beam, {"root"}).nodes["end"].Phi
    assert ((Phi != 0).sum(axis=0) == 1).all()


def test_modal_mass_is_the_identity(body: Superelement) -> None:
    assert body.modal_mass == pytest.approx(np.eye(N), abs=1e-9)


def test_mass_centre_and_inertia_are_those_of_a_bar_with_a_mass(body: Superelement) -> None:
    m = RHO * BAR.area * L
    assert body.mass == pytest.approx(m + TIP, rel=1e-12)
    assert body.s[0] == pytest.approx([m * L / 2 + TIP * L, 0, 0], rel=1e-12, abs=1e-15)
    inertia = np.trace(body.P[0, 0]) * np.eye(3) - body.P[0, 0]
    about = m * L**2 / 3 + TIP * L**2
    thick = m / 12 * np.array([WIDTH**2 + HEIGHT**2, HEIGHT**2, WIDTH**2])
    assert inertia == pytest.approx(np.diag(thick + [0, about, about]), rel=1e-12, abs=1e-15)


def test_a_node_moves_as_the_exact_body(body: Superelement, modes: list[Mode]) -> None:
    x = np.array([0.3])
    exact = np.array([mode.field(x, np.zeros(1), np.zeros(1))[:, 0] for mode in modes]).T  # (3, N)
    assert abs(body.nodes["middle"].Phi) == pytest.approx(abs(exact), abs=2e-4)


def test_a_gauge_reads_the_exact_curvature() -> None:
    exact = cantilever(BAR.E, BAR.I_z, RHO * BAR.area, L, TIP, L, 2, rho_I=RHO * BAR.I_z)
    beam = replace(bar(elements=32, point_masses=tip_mass(TIP)), nodes={"root": 0.0, "gauge": 0.02})
    node = reduce_body(beam, {"root"}).nodes["gauge"]
    curvature = [abs(float(shape(0.02, 2))) for shape in exact.shapes]
    assert abs(node.strain[1, :2]) == pytest.approx(curvature, rel=1e-3)  # curvature is of order 2
    assert not node.strain[[0, 2]].any()


def test_shortening_of_a_half_sine_is_its_closed_form() -> None:
    beam = replace(bar(elements=24), reduction=Reduction("craig_bampton", 1, "chord"))
    body = reduce_body(beam, {"root", "end"})
    k = np.pi / L
    amplitude_2 = 2 / L / (RHO * BAR.area + RHO * BAR.I_z * k**2)  # modal mass one
    end = body.nodes["end"]
    assert end.G[0, 0, 0] == pytest.approx(-amplitude_2 * k**2 * L / 2, rel=1e-6)
    assert not end.G[1:].any() and abs(end.Phi).max() < 1e-12


def test_a_rigid_body_is_the_sum_of_its_points() -> None:
    rng = np.random.default_rng(5)
    points, masses = rng.uniform(-1, 1, (40, 3)), rng.uniform(0.1, 1, 40)
    mass, com = masses.sum(), masses @ points / masses.sum()
    lever = points - com
    inertia = sum(m * (c @ c * np.eye(3) - np.outer(c, c)) for m, c in zip(masses, lever, strict=True))
    body = reduce_body(RigidBody("cloud", mass, com, np.array(inertia), {"root": np.zeros(3)}), {"root"})
    assert body.n == 0 and body.mass == pytest.approx(mass)
    assert body.s[0] == pytest.approx(masses @ points)
    assert body.P[0, 0] == pytest.approx(np.einsum("k,ki,kj->ij", masses, points, points))
