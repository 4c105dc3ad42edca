"""Reduction bases: exact where they promise to be, from above and monotone elsewhere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from arms import BAR, bar, tip_mass
from beam_theory import cantilever
from scipy.linalg import eigh

from flexarm_model.bodies.body_reduction import reduce_body
from flexarm_model.bodies.reduction import craig_bampton, guyan, mode_basis
from flexarm_model.manipulator.body_spec import Beam, Reduction

Matrices = tuple[np.ndarray, np.ndarray]
RHO_A = BAR.density * BAR.area
BOUNDARY = np.array([2, 7], dtype=np.intp)


@pytest.fixture(scope="module")
def matrices() -> Matrices:
    rng = np.random.default_rng(3)
    a, b = rng.standard_normal((2, 12, 12))
    return a @ a.T + 12 * np.eye(12), b @ b.T + np.eye(12)


def reduced_omega(M: np.ndarray, K: np.ndarray, basis: np.ndarray) -> np.ndarray:
    return np.array(np.sqrt(eigh(basis.T @ K @ basis, basis.T @ M @ basis, eigvals_only=True)))


def test_guyan_answers_static_loads_on_the_boundary_exactly(matrices: Matrices) -> None:
    _, K = matrices
    force = np.zeros(12)
    force[BOUNDARY] = [1.0, -2.0]
    basis = guyan(matrices[1], BOUNDARY)
    reduced = basis @ np.linalg.solve(basis.T @ K @ basis, basis.T @ force)
    assert reduced == pytest.approx(np.linalg.solve(K, force), rel=1e-10)


def test_craig_bampton_with_all_modes_is_the_whole_body(matrices: Matrices) -> None:
    M, K = matrices
    full = np.sqrt(eigh(K, M, eigvals_only=True))
    assert reduced_omega(M, K, craig_bampton(M, K, BOUNDARY, 10)) == pytest.approx(full, rel=1e-9)


def test_craig_bampton_without_modes_is_guyan(matrices: Matrices) -> None:
    assert np.array_equal(craig_bampton(*matrices, BOUNDARY, 0), guyan(matrices[1], BOUNDARY))


def test_frequencies_fall_monotonically_onto_the_exact_ones(matrices: Matrices) -> None:
    M, K = matrices
    full = np.sqrt(eigh(K, M, eigvals_only=True))[:2]
    found = np.array([reduced_omega(M, K, craig_bampton(M, K, BOUNDARY, n))[:2] for n in range(11)])
    assert (np.diff(found, axis=0) <= 1e-12).all() and (found >= full * (1 - 1e-12)).all()
    assert found[0, 0] > 1.001 * full[0]


def test_mode_basis_is_mass_normalised_ordered_and_signed(matrices: Matrices) -> None:
    M, K = matrices
    basis = craig_bampton(M, K, BOUNDARY, 4)
    modes, omega = mode_basis(M, K, basis, 5)
    assert modes.T @ M @ modes == pytest.approx(np.eye(5), abs=1e-12)
    assert modes.T @ K @ modes == pytest.approx(np.diag(omega**2), abs=1e-10)
    assert (np.diff(omega) > 0).all() and (modes.max(axis=0) == abs(modes).max(axis=0)).all()


def test_impossible_reductions_are_refused(matrices: Matrices) -> None:
    with pytest.raises(ValueError, match="at least one retained"):
        guyan(matrices[1], np.array([], dtype=np.intp))
    with pytest.raises(ValueError, match="11 fixed-interface modes asked for, 10 exist"):
        craig_bampton(*matrices, BOUNDARY, 11)
    with pytest.raises(ValueError, match="body 'bar': 99 modes asked for"):
        reduce_body(reduced("guyan", 99, retain=("end",)), {"root"})


def reduced(method: str, modes: int, frame: str = "clamped", retain: tuple[str, ...] = ()) -> Beam:
    return replace(bar(elements=24), reduction=Reduction(method, modes, frame, retain))


def test_the_chord_frame_makes_a_beam_pinned_at_both_ends() -> None:
    omega = reduce_body(reduced("craig_bampton", 3, "chord"), {"root", "end"}).omega
    EI, k = BAR.E * BAR.I_z, np.arange(1, 4) * np.pi / BAR.length
    slender = k**2 * np.sqrt(EI / RHO_A)  # n^2 pi^2 sqrt(EI / rho A) / L^2
    rotary = slender / np.sqrt(1 + BAR.density * BAR.I_z * k**2 / RHO_A)
    assert omega == pytest.approx(rotary, rel=2e-5)  # (k h)^4 / 1440 for the third of 24 elements
    assert omega[0] == pytest.approx(slender[0], rel=1e-4)


def test_the_clamped_frame_makes_a_cantilever() -> None:
    exact = cantilever(BAR.E, BAR.I_z, RHO_A, BAR.length, 0.2, BAR.length, 3, BAR.density * BAR.I_z)
    beam = replace(reduced("craig_bampton", 3), point_masses=tip_mass(0.2))
    assert reduce_body(beam, {"root"}).omega == pytest.approx(exact.omega, rel=2e-5)


def test_one_chord_mode_does_what_takes_two_clamped_ones() -> None:
    """A link between two hinges: its first frequency from one mode in either frame."""
    pinned = np.pi**2 * np.sqrt(BAR.E * BAR.I_z / RHO_A) / BAR.length**2
    chord = reduce_body(reduced("craig_bampton", 1, "chord"), {"root", "end"}).omega[0]
    clamped = reduce_body(reduced("craig_bampton", 1, "clamped"), {"root"}).omega[0]
    assert chord == pytest.approx(pinned, rel=1e-4) and clamped < 0.4 * pinned


def test_a_welded_node_between_the_ends_of_a_chord_bends_exactly_under_what_is_welded_to_it() -> None:
    """On two hinges a^2 b^2 / (3 EI L) gives in to a force, (a^3 + b^3) / (3 EI L^2) to a moment."""
    a = 0.4 * BAR.length
    beam = bar(elements=24, nodes={"root": 0.0, "mid": a, "end": BAR.length})
    beam = replace(beam, reduction=Reduction("craig_bampton", 3, "chord"))
    body = reduce_body(beam, {"root", "mid", "end"})
    shapes = np.vstack([body.nodes["mid"].Phi[1], body.nodes["mid"].Psi[2]]) / body.omega
    b, EI, L = BAR.length - a, BAR.E * BAR.I_z, BAR.length
    both = a * b * (b - a) / (3 * EI * L)
    exact = [[a**2 * b**2 / (3 * EI * L), both], [both, (a**3 + b**3) / (3 * EI * L**2)]]
    assert shapes @ shapes.T == pytest.approx(np.array(exact), rel=1e-8)


def test_a_welded_chord_keeps_stretch_and_twist_of_its_ends() -> None:
    """It kept neither: of a leg between hinges nothing gave in along its axis."""
    beam = bar(["bend_y", "stretch", "torsion"], elements=8)
    body = reduce_body(replace(beam, reduction=Reduction("guyan", 0, "chord")), {"root", "end"})
    shapes = np.vstack([body.nodes["end"].Phi[0], body.nodes["end"].Psi[0]]) / body.omega
    soft = BAR.length / (BAR.E * BAR.area), BAR.length / (BAR.G * BAR.torsion_constant)
    assert shapes @ shapes.T == pytest.approx(np.diag(soft), rel=1e-8, abs=1e-12)


@pytest.mark.parametrize("method", ["guyan", "craig_bampton"])
def test_a_retained_end_bends_exactly_under_a_load_on_it(method: str) -> None:
    modes = {"guyan": 2, "craig_bampton": 5}[method]
    body = reduce_body(reduced(method, modes, retain=("end",)), {"root"})
    end = body.nodes["end"]
    load = np.array([0.0, 1.0, 0.0])
    eta = np.linalg.solve(body.K, end.Phi.T @ load)
    assert (end.Phi @ eta)[1] == pytest.approx(BAR.length**3 / (3 * BAR.E * BAR.I_z), rel=1e-9)
    assert (end.Psi @ eta)[2] == pytest.approx(BAR.length**2 / (2 * BAR.E * BAR.I_z), rel=1e-9)


def test_craig_bampton_of_a_beam_converges_from_above() -> None:
    exact = cantilever(BAR.E, BAR.I_z, RHO_A, BAR.length, 1e-12, 0.5, 2, BAR.density * BAR.I_z).omega
    sizes = (2, 3, 4, 6)
    found = [reduce_body(reduced("craig_bampton", n, retain=("end",)), {"root"}).omega[:2] for n in sizes]
    errors = np.array(found) / exact - 1
    assert (errors > -1e-9).all() and (np.diff(errors, axis=0) < 0).all()
    assert errors[-1] == pytest.approx(0.0, abs=2e-4) and errors[0, 0] > 1e-3


@pytest.mark.parametrize("rounding", [1e-13, -1e-13])
def test_of_components_as_large_the_first_fixes_the_sign_whatever_rounding_says(
    rounding: float,
) -> None:
    """Two equal masses that swing against each other: which of them moves more is chance."""
    K = np.array([[2.0 + rounding, -1.0], [-1.0, 2.0 - rounding]])
    modes, _ = mode_basis(np.eye(2), K, np.eye(2), 2)
    np.testing.assert_allclose(modes, np.array([[1.0, 1.0], [1.0, -1.0]]) / np.sqrt(2.0), atol=1e-9)
