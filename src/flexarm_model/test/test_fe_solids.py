"""The bricks of the tests and benchmarks: patch test, beams in closed form, checks that find faults."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from beam_theory import cantilever
from fe_bodies import ALUMINIUM, HEIGHT, LENGTH, WIDTH, block, bracket, model
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import eigh

from flexarm_model.fe_import.checks import check_model, refuse_unsound
from flexarm_model.fe_import.fe_model import FeModel
from flexarm_model.fe_import.hexahedra import Solid

Array = NDArray[np.float64]

FREE = np.array([4.730040744862704, 7.853204624095838])  # roots of cos b cosh b = 1


def clamped(solid: Solid) -> NDArray[np.intp]:
    """Return the displacements of a block that are free when its root face is clamped."""
    return np.flatnonzero(np.repeat(solid.x[:, 0] > 1e-9, 3))


def test_a_linear_displacement_makes_a_constant_stress() -> None:
    """The patch test: inner nodes feel no force, the faces that of the exact stress."""
    solid = block(4)
    gradient = np.array([[1.0, 0.3, -0.2], [0.5, -0.7, 0.4], [0.1, 0.6, 0.8]])
    force = (solid.K @ (solid.x @ gradient.T).ravel()).reshape(-1, 3)
    E, nu = ALUMINIUM.E, ALUMINIUM.nu
    strain = (gradient + gradient.T) / 2
    stress = E / (1 + nu) * (strain + nu / (1 - 2 * nu) * np.trace(strain) * np.eye(3))
    high = solid.x.max(axis=0)
    inner = (abs(solid.x - solid.x.min(axis=0)) > 1e-9).all(axis=1) & (abs(solid.x - high) > 1e-9).all(axis=1)
    assert inner.any() and abs(force[inner]).max() < 1e-9 * abs(force).max()
    areas = {0: WIDTH * HEIGHT, 1: LENGTH * HEIGHT, 2: LENGTH * WIDTH}
    for axis, area in areas.items():  # nodes on edges carry what their other faces bear, too: take the sums
        on = abs(solid.x[:, axis] - high[axis]) < 1e-9
        lone = on & (abs(solid.x - high) > 1e-9).sum(axis=1).astype(bool)
        assert lone.any()
        moment = (solid.x[:, axis] - solid.x[:, axis].mean()) @ force  # first moment: volume times stress
        assert moment == pytest.approx(stress[axis] * area * np.ptp(solid.x[:, axis]), rel=1e-9, abs=1e-3)


@pytest.mark.parametrize("lumped", [False, True])
def test_a_solid_weighs_its_volume(lumped: bool) -> None:
    checks = check_model(model(block(lumped=lumped)))
    mass = ALUMINIUM.density * LENGTH * WIDTH * HEIGHT
    exact = mass / 12 * np.array([WIDTH**2 + HEIGHT**2, LENGTH**2 + HEIGHT**2, LENGTH**2 + WIDTH**2])
    cells = np.array([LENGTH / 10, WIDTH / 2, HEIGHT / 2])
    spread = (
        mass / 6 * (cells @ cells - cells**2)
    )  # point masses at the corners: m h^2 / 6 more per direction
    assert checks.rigid.mass == pytest.approx(mass, rel=1e-12)
    assert checks.rigid.com == pytest.approx([LENGTH / 2, 0, 0], abs=1e-12)
    inertia = checks.rigid.inertia_about_com
    assert inertia == pytest.approx(np.diag(exact + lumped * spread), rel=1e-9, abs=1e-12)


def test_a_free_solid_has_six_rigid_modes_and_no_problem() -> None:
    checks = check_model(model(bracket()))
    assert checks.n_rigid == 6 and checks.problems == [] and checks.unlike < 1e-12
    solid = bracket()
    full = np.sqrt(eigh(solid.K.toarray(), solid.M.toarray(), eigvals_only=True)[6:10]) / (2 * np.pi)
    assert checks.elastic_hz == pytest.approx(full, rel=1e-8)
    for fragment in ("mass [kg]", "centre of mass", "rigid modes", "none"):
        assert fragment in checks.text()


def test_size_and_mass_over_it_are_told() -> None:
    checks = check_model(model(block()))
    assert checks.size == pytest.approx([LENGTH, WIDTH, HEIGHT], rel=1e-12)
    assert checks.density == pytest.approx(ALUMINIUM.density, rel=1e-9) and checks.suspicions == []
    assert "0.4, 0.02, 0.016" in checks.text() and "suspicions" not in checks.text()


@pytest.mark.parametrize(("scale", "side"), [(1e-3, "too heavy"), (1e3, "too light")])
def test_a_solid_in_another_unit_of_length_is_told(scale: float, side: str) -> None:
    """Its matrices, and so its frequencies, are the same: mm taken for m, and m for mm, passed all checks."""
    checks = check_model(replace(model(bracket()), x=scale * bracket().x))
    assert checks.problems == [] and checks.n_rigid == 6
    (said,) = checks.suspicions
    assert said.startswith(side) and "units of length" in said and said in checks.text()


@pytest.mark.parametrize(("scale", "is_odd"), [(1e-3, True), (4.0, False), (1e3, True)])
def test_a_solid_in_another_unit_of_mass_is_told(scale: float, is_odd: bool) -> None:
    """A block of gold, four times as heavy as aluminium, and more, is none."""
    sound = model(block())
    assert bool(check_model(replace(sound, M=scale * sound.M)).suspicions) == is_odd


def test_a_free_slender_block_rings_like_a_beam() -> None:
    found = check_model(model(block(20))).elastic_hz
    area = WIDTH * HEIGHT
    flat, upright = (
        (FREE / LENGTH) ** 2 * np.sqrt(ALUMINIUM.E * second / (ALUMINIUM.density * area)) / (2 * np.pi)
        for second in (WIDTH * HEIGHT**3 / 12, HEIGHT * WIDTH**3 / 12)
    )
    expected = np.array([flat[0], upright[0], flat[1], upright[1]])
    # shear and rotary inertia, which the formula leaves out, lower them by some (b r / L)^2, r the gyradius
    assert found == pytest.approx(expected, rel=0.01) and (found < expected * 1.0005).all()


def test_a_clamped_slender_block_converges_on_the_cantilever() -> None:
    second, area, rho = WIDTH * HEIGHT**3 / 12, WIDTH * HEIGHT, ALUMINIUM.density
    exact = cantilever(ALUMINIUM.E, second, rho * area, LENGTH, 1e-12, LENGTH, 1, rho * second).omega[0]
    found = []
    for n in (5, 10, 20):
        solid = block(n, nu=0.0)  # or the clamp would hold the section's width, too
        free = clamped(solid)
        K, M = (matrix[free][:, free].toarray() for matrix in (solid.K, solid.M))
        found.append(np.sqrt(eigh(K, M, eigvals_only=True, subset_by_index=(0, 0))[0]))
    assert found[-1] == pytest.approx(exact, rel=2e-3)  # shear lowers it by 0.1 %
    steps = np.diff(found)
    assert 3.0 < steps[0] / steps[1] < 8.0  # order two in the length of a brick, or a little better


def broken(**changes: object) -> FeModel:
    return replace(model(bracket()), **changes)  # type: ignore[arg-type]


def test_faults_of_the_matrices_are_named() -> None:
    solid = bracket()
    n = solid.M.shape[0]
    skewed = solid.K + sparse.coo_array(([1e-3 * abs(solid.K).max()], ([0], [5])), shape=(n, n)).tocsr()
    held = solid.K + 1e-3 * abs(solid.K).max() * sparse.eye_array(n, format="csr")
    for fault, expected in (
        (broken(K=skewed), "the stiffness is not symmetric"),
        (broken(K=held), "the stiffness resists rigid motion"),
        (broken(x=solid.x * [1, 1, 1.01]), "the stiffness resists rigid motion"),
        (broken(M=-solid.M), "expected above 0"),
    ):
        with pytest.raises(ValueError, match=expected):
            refuse_unsound(fault)


def test_faults_that_only_modes_show_are_named() -> None:
    solid = bracket()
    apart = sparse.block_diag([solid.K, solid.K], format="csr")
    twice = FeModel(
        "two", np.vstack([solid.x, solid.x + 1]), sparse.block_diag([solid.M] * 2, format="csr"), apart, None
    )
    assert check_model(twice).problems == [
        "at least 10 modes of the free body have no stiffness; expected the 6 rigid ones"
    ]
    force = solid.K @ np.random.default_rng(1).standard_normal(solid.M.shape[0])
    energy = force @ np.linalg.lstsq(solid.K.toarray(), force, rcond=None)[0]
    softer = solid.K - 2 / energy * sparse.csr_array(np.outer(force, force))  # turns one eigenvalue negative
    assert "the stiffness has 1 negative eigenvalues; expected none" in check_model(broken(K=softer)).problems
    assert check_model(broken(D=1e-5 * solid.K)).problems == []
    feeding = check_model(broken(D=1e-5 * softer))
    assert "the damping has 1 negative eigenvalues; expected none" in feeding.problems
    assert "  negative eigenvalues of M, K, D  0, 0, 1" in feeding.text()
