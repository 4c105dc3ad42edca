"""Superelements of imported bodies against integrals over the bricks, sums over points, and beams."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from arms import BAR, bar
from fe_bodies import ALUMINIUM, block, bracket, load_body, model
from numpy.typing import NDArray
from scipy import io, sparse

from flexarm_model.bodies.beam import BeamMesh
from flexarm_model.bodies.body_reduction import reduce_body
from flexarm_model.bodies.reduction import mode_basis
from flexarm_model.bodies.superelement import Superelement
from flexarm_model.fe_import.fe_model import FeModel, load_model
from flexarm_model.fe_import.hexahedra import Solid
from flexarm_model.fe_import.volume_integrals import volume_integrals
from flexarm_model.manipulator.body_spec import Reduction
from flexarm_model.manipulator.imported_body import MatrixFile
from flexarm_model.numeric.rotation import skew

Array = NDArray[np.float64]

BOTH = {"root", "end"}
KINDS = ("bend_y", "bend_z", "torsion", "stretch")


def brick_integrals(solid: Solid, modes: Array, size: Array) -> tuple[Array, Array]:
    """Return s and P by Gauss quadrature over every brick of a solid, shapes written out."""
    fields = np.concatenate([solid.x[None], modes.T.reshape(-1, *solid.x.shape)])  # (n_f, k, 3)
    index = {tuple(point): k for k, point in enumerate(np.round(solid.x / size).astype(int))}
    point, weight = np.polynomial.legendre.leggauss(3)
    s, P = np.zeros((fields.shape[0], 3)), np.zeros((fields.shape[0],) * 2 + (3, 3))
    for cell in index:
        corners = [tuple(np.add(cell, step)) for step in np.ndindex(2, 2, 2)]
        if not all(corner in index for corner in corners) or not is_full(cell):
            continue
        at = np.array([index[corner] for corner in corners])
        for a, b, c in np.ndindex(3, 3, 3):
            xi = (1 + point[[a, b, c]]) / 2
            shape = np.array([np.prod([u if k else 1 - u for u, k in zip(xi, step, strict=True)])
                              for step in np.ndindex(2, 2, 2)])  # fmt: skip
            dm = ALUMINIUM.density * np.prod(size) / 8 * weight[a] * weight[b] * weight[c]
            N = np.einsum("fki,k->fi", fields[:, at], shape)
            s += dm * N
            P += dm * np.einsum("ai,bj->abij", N, N)
    return s, P


def is_full(cell: tuple[int, ...]) -> bool:
    """Return whether a cell of the bracket's grid is a brick; corners alone do not tell."""
    i, j, k = cell
    return k == 0 or i == 0 or (i, j, k) == (3, 0, 1)


def test_consistent_integrals_are_those_over_the_bricks() -> None:
    solid = bracket()
    modes = np.random.default_rng(4).standard_normal((solid.M.shape[0], 3))
    s, P = volume_integrals(model(solid), modes)
    s_exact, P_exact = brick_integrals(solid, modes, np.array([0.03, 0.025, 0.02]))
    assert s == pytest.approx(s_exact, abs=1e-12 * abs(s_exact).max())
    size = np.sqrt(np.einsum("aaii->a", P_exact))
    assert (abs(P - P_exact) < 1e-12 * (size[:, None] * size)[:, :, None, None]).all()


def test_lumped_integrals_are_sums_over_points() -> None:
    solid = bracket(lumped=True)
    modes = np.random.default_rng(5).standard_normal((solid.M.shape[0], 3))
    dm = solid.M.diagonal()[::3]
    fields = np.concatenate([solid.x[None], modes.T.reshape(-1, *solid.x.shape)])
    s, P = volume_integrals(model(solid), modes)
    assert s == pytest.approx(np.einsum("aki,k->ai", fields, dm), rel=1e-9, abs=1e-12)
    assert pytest.approx(np.einsum("aki,bkj,k->abij", fields, fields, dm), rel=1e-9, abs=1e-12) == P


def test_the_superelement_is_mass_normalised_and_weighs_the_solid(tmp_path: Path) -> None:
    element = reduce_body(load_body(tmp_path, bracket()), BOTH)
    volume = bracket().M.sum() / 3 / ALUMINIUM.density
    assert element.modal_mass == pytest.approx(np.eye(element.n), abs=1e-9)
    assert element.mass == pytest.approx(volume * ALUMINIUM.density, rel=1e-12)
    assert pytest.approx(np.diag(element.omega**2)) == element.K and not element.D.any()


@pytest.mark.parametrize("kind", ["rigid", "averaging"])
def test_root_is_the_frame_and_stays_at_rest(kind: str, tmp_path: Path) -> None:
    interfaces = {"root": {"set": "root.txt", "kind": kind}, "end": {"set": "end.txt", "kind": "averaging"}}
    root = reduce_body(load_body(tmp_path, bracket(), interfaces=interfaces), BOTH).nodes["root"]
    assert not root.r.any() and abs(np.vstack([root.Phi, root.Psi])).max() < 1e-9


def test_a_retained_node_keeps_its_static_modes_without_a_joint(tmp_path: Path) -> None:
    kept = load_body(tmp_path, bracket(), reduction={"method": "guyan", "retain": ["end"]})
    assert reduce_body(kept, {"root"}).omega == pytest.approx(reduce_body(kept, BOTH).omega, rel=1e-12)


def test_units_of_the_files_do_not_matter(tmp_path: Path) -> None:
    """The same body in millimetres and tonnes; a force is then in newtons again."""
    solid = bracket()
    tonnes = Solid(solid.x * 1e3, solid.M * 1e-3, solid.K * 1e-3)
    kilo = Solid(solid.x * 1e3, solid.M, solid.K * 1e-6)  # millimetres, kilograms, milliseconds
    expected = reduce_body(load_body(tmp_path, solid), BOTH)
    for other, units in (
        (tonnes, {"length": "mm", "mass": "t"}),
        (kilo, {"length": "mm", "mass": "kg", "time": "ms"}),
    ):
        found = reduce_body(load_body(tmp_path, other, units=units), BOTH)
        assert found.omega == pytest.approx(expected.omega, rel=1e-9)
        assert found.mass == pytest.approx(expected.mass, rel=1e-12)
        assert found.P[0, 0] == pytest.approx(expected.P[0, 0], rel=1e-9, abs=1e-12)
        assert abs(found.nodes["end"].Phi) == pytest.approx(
            abs(expected.nodes["end"].Phi), rel=1e-6, abs=1e-7
        )


def test_axes_of_the_files_may_be_turned(tmp_path: Path) -> None:
    plain = reduce_body(load_body(tmp_path, bracket()), BOTH)
    turned = reduce_body(load_body(tmp_path, bracket(), orientation=["0 deg", "0 deg", "90 deg"]), BOTH)
    R = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    assert turned.omega == pytest.approx(plain.omega, rel=1e-9)
    assert turned.P[0, 0] == pytest.approx(R @ plain.P[0, 0] @ R.T, abs=1e-12)
    assert turned.nodes["end"].r == pytest.approx(R @ plain.nodes["end"].r, abs=1e-12)
    assert abs(turned.nodes["end"].Phi) == pytest.approx(abs(R @ plain.nodes["end"].Phi), abs=1e-7)


def test_a_damping_matrix_is_reduced_with_the_modes(tmp_path: Path) -> None:
    body = load_body(tmp_path, bracket())
    alike = replace(body, damping=body.stiffness, damping_ratio=0.0)
    element = reduce_body(alike, BOTH)
    assert pytest.approx(element.K, rel=1e-9, abs=1e-6 * element.K.max()) == element.D
    assert (
        pytest.approx(0.04 * np.diag(element.omega))
        == reduce_body(replace(body, damping_ratio=0.02), BOTH).own_damping
    )


@pytest.mark.parametrize(
    ("shear", "scale", "expected"),
    [(1e-3, 1.0, "the damping is not symmetric"), (0.0, -1.0, "the damping feeds its modes: one grows by")],
)
def test_a_damping_matrix_that_damps_nothing_is_refused(
    shear: float, scale: float, expected: str, tmp_path: Path
) -> None:
    """Half of either was taken: damping ratios of -3 % were served as any other."""
    solid = bracket()
    body = load_body(tmp_path, solid)
    D = (scale * 1e-5 * solid.K).tolil()
    D[0, 5] += shear * 1e-5 * abs(solid.K).max()
    io.mmwrite(tmp_path / "damping.mtx", D.tocoo(), precision=17, symmetry="general")
    with pytest.raises(ValueError, match=f"body 'solid': {expected}"):
        reduce_body(replace(body, damping=MatrixFile(tmp_path / "damping.mtx")), BOTH)


def test_what_a_damping_matrix_holds_of_the_mass_damps_the_modes_alone(tmp_path: Path) -> None:
    """Rayleigh's matrix resists rigid motion, which no body in the air feels."""
    solid = bracket()
    body = load_body(tmp_path, solid)
    io.mmwrite(tmp_path / "damping.mtx", (5.0 * solid.M + 1e-5 * solid.K).tocoo(), precision=17)
    element = reduce_body(
        replace(body, damping=MatrixFile(tmp_path / "damping.mtx"), damping_ratio=0.0), BOTH
    )
    assert np.diag(element.D) == pytest.approx(5.0 + 1e-5 * element.omega**2, rel=1e-9)


def test_a_stiffer_plant_is_the_same_body_with_faster_modes(tmp_path: Path) -> None:
    body = load_body(tmp_path, bracket())
    assert reduce_body(replace(body, stiffness_scale=1.21), BOTH).omega == pytest.approx(
        1.1 * reduce_body(body, BOTH).omega, rel=1e-9
    )


def test_a_grounded_body_is_refused(tmp_path: Path) -> None:
    solid = bracket()
    held = solid.K.tolil()
    held[0, 0] *= 1.5
    with pytest.raises(ValueError, match="body 'solid': the stiffness resists rigid motion"):
        reduce_body(load_body(tmp_path, Solid(solid.x, solid.M, held.tocsr())), BOTH)


def imported_bar(elements: int) -> tuple[Superelement, FeModel, Array, Array]:
    """Return our own beam reduced, its matrices as an import, its modes there and their frequencies."""
    beam = replace(bar(KINDS, elements=elements), reduction=Reduction("craig_bampton", 4, "clamped"))
    mesh = BeamMesh(beam, ["root"])
    M, K = mesh.matrices()
    modes = np.zeros((mesh.n_dof, 4))
    modes[6:], omega = mode_basis(M[6:, 6:], K[6:, 6:], np.eye(mesh.n_dof - 6), 4)
    x = np.column_stack([mesh.nodes, np.zeros((mesh.nodes.size, 2))])
    return reduce_body(beam, {"root"}), FeModel("bar", x, M, K, None), modes, omega


def test_integrals_of_nodal_rotations_are_exact_where_they_claim_to_be() -> None:
    """The integrals over the sections of our own beam are the oracle."""
    exact, mesh, modes, omega = imported_bar(24)
    s, P = volume_integrals(mesh, modes)
    assert omega == pytest.approx(exact.omega, rel=1e-9)
    assert s == pytest.approx(exact.s[:5], abs=1e-9)
    assert P[0, 0] == pytest.approx(exact.P[0, 0], rel=1e-9, abs=1e-12)
    assert np.trace(P[1:, 1:], axis1=2, axis2=3) == pytest.approx(np.eye(4), abs=1e-9)
    turn, exact_turn = (p[0, 1:5] - p[0, 1:5].transpose(0, 2, 1) for p in (P, exact.P))
    assert turn == pytest.approx(exact_turn, abs=1e-9)
    assert P[1:, 1:] == pytest.approx(exact.P[1:5, 1:5], abs=5e-3)  # the part that is approximate


@pytest.mark.parametrize("elements", [3, 24])
def test_a_straight_beam_s_centrifugal_forces_do_not_hang_on_its_mesh(elements: int) -> None:
    """Of three elements the mean of the translational blocks took 12 % of them across, where nothing lies."""
    exact, mesh, modes, _ = imported_bar(elements)
    _, P = volume_integrals(mesh, modes)
    assert P[0, 1:] == pytest.approx(exact.P[0, 1:5], abs=2e-4)  # the sections' own inertia


def test_masses_beside_their_nodes_pull_as_they_do_there() -> None:
    """A tool on a beam, as a mass with a lever: turning it bent the beam by nothing."""
    rng = np.random.default_rng(7)
    x, levers, m = rng.standard_normal((5, 3)), rng.standard_normal((5, 3)), rng.uniform(0.1, 1.0, 5)
    carried = np.array([np.hstack([np.eye(3), -skew(e)]) for e in levers])  # of what is on a lever
    blocks = m[:, None, None] * carried.transpose(0, 2, 1) @ carried
    M = sparse.block_diag([sparse.coo_array(block) for block in blocks], format="csr")
    modes = rng.standard_normal((30, 4))
    s, P = volume_integrals(FeModel("masses", x, M, M, None), modes)
    places, moved = x + levers, np.einsum("kij,kja->aki", carried, modes.reshape(5, 6, 4))
    assert s[1:] == pytest.approx(np.einsum("k,aki->ai", m, moved))
    assert P[0, 0] == pytest.approx(np.einsum("k,ki,kj->ij", m, places, places))
    assert P[0, 1:] == pytest.approx(np.einsum("k,ki,akj->aij", m, places, moved))


def test_a_block_and_a_beam_have_one_superelement(tmp_path: Path) -> None:
    element = reduce_body(
        load_body(tmp_path, block(20, nu=0.0), reduction={"method": "craig_bampton", "modes": 8}), BOTH
    )
    piece = replace(BAR, length=0.4, area=0.020 * 0.016, I_y=0.020 * 0.016**3 / 12, I_z=0.016 * 0.020**3 / 12)
    beam = replace(
        bar(("bend_y", "bend_z")), pieces=(replace(piece, E=ALUMINIUM.E),), nodes={"root": 0.0, "end": 0.4}
    )
    other = reduce_body(replace(beam, reduction=Reduction("craig_bampton", 4, "clamped")), {"root"})
    assert element.omega[:2] == pytest.approx(other.omega[:2], rel=2e-3)
    for a in (1, 2):
        assert abs(element.s[a]) == pytest.approx(abs(other.s[a]), abs=2e-3)
        assert abs(element.P[0, a]) == pytest.approx(abs(other.P[0, a]), abs=1e-3)
    assert element.P[1, 1] == pytest.approx(other.P[1, 1], abs=1e-3)
    assert abs(element.nodes["end"].Psi[:, :2]) == pytest.approx(
        abs(other.nodes["end"].Psi[:, :2]), rel=5e-3, abs=0.1
    )


def test_the_model_is_in_si(tmp_path: Path) -> None:
    body = load_body(tmp_path, bracket())
    loaded = load_model(body)
    assert abs(loaded.M - bracket().M).max() < 1e-15 and loaded.dof_per_node == 3
