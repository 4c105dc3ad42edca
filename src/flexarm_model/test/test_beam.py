"""Beam finite elements against closed forms and the exact beam."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from arms import BAR, bar, tip_mass
from beam_theory import cantilever
from scipy.linalg import eigh
from scipy.optimize import brentq

from flexarm_model.bodies.beam import BeamMesh
from flexarm_model.manipulator.body_spec import Beam

L, A, E, G, RHO = BAR.length, BAR.area, BAR.E, BAR.G, BAR.density
J_P = BAR.I_y + BAR.I_z
MASS = RHO * A * L


def clamped_frequencies(beam: Beam, count: int) -> np.ndarray:
    """Return the slowest angular frequencies with the root held [rad/s], (count,)."""
    mesh = BeamMesh(beam)
    M, K = mesh.matrices()
    free = np.setdiff1d(mesh.active, mesh.dof("root"))
    return np.array(np.sqrt(eigh(K[np.ix_(free, free)], M[np.ix_(free, free)], eigvals_only=True)[:count]))


def exact(I: float, count: int, mass: float = 0.2, at: float = L) -> np.ndarray:  # noqa: E741
    return cantilever(E, I, RHO * A, L, mass, at, count, rho_I=RHO * I).omega


@pytest.mark.parametrize(("kind", "I"), [("bend_y", BAR.I_z), ("bend_z", BAR.I_y)])
def test_cantilever_with_point_mass_has_the_exact_frequencies(kind: str, I: float) -> None:  # noqa: E741
    beam = bar([kind], elements=16, point_masses=tip_mass(0.2, 0.4), nodes={"root": 0.0, "end": 0.4})
    mesh = BeamMesh(beam, ["end"])
    M, K = mesh.matrices()
    free = np.setdiff1d(mesh.active, mesh.dof("root"))
    omega = np.sqrt(eigh(K[np.ix_(free, free)], M[np.ix_(free, free)], eigvals_only=True)[:3])
    # cubic elements: the third frequency is off by about (beta h)^4 / 1440, beta h = 7.9 / 16
    assert omega == pytest.approx(exact(I, 3, at=0.4), rel=4e-5)


def test_frequencies_converge_with_order_four_from_above() -> None:
    sizes = np.array([4, 8, 16])
    computed = [clamped_frequencies(bar(elements=n, point_masses=tip_mass(0.2)), 3) for n in sizes]
    errors = np.array(computed) / exact(BAR.I_z, 3) - 1  # (3, 3)
    assert (errors > 0).all()
    order = np.log2(errors[:-1] / errors[1:])  # (2, 3)
    assert order[:, 1:] == pytest.approx(4.0, abs=0.15)  # the first frequency's error drowns in rounding
    assert order[0, 0] == pytest.approx(4.0, abs=0.15)


def test_rotary_inertia_lowers_the_frequencies_as_the_exact_beam_does() -> None:
    thick = replace(BAR, I_z=BAR.I_z * 100)  # slender no more: 2 % of the third frequency
    beam = replace(bar(elements=24), pieces=(replace(thick, elements=24),))
    with_it = cantilever(E, thick.I_z, RHO * A, L, 1e-12, L, 3, rho_I=RHO * thick.I_z).omega
    without = cantilever(E, thick.I_z, RHO * A, L, 1e-12, L, 3).omega
    assert clamped_frequencies(beam, 3) == pytest.approx(with_it, rel=2e-5)
    assert with_it[2] < 0.985 * without[2]


@pytest.mark.parametrize(
    ("kind", "speed"),
    [("torsion", np.sqrt(G * BAR.torsion_constant / (RHO * J_P))), ("stretch", np.sqrt(E / RHO))],
    ids=["torsion", "stretch"],
)
def test_torsion_and_stretch_are_waves_in_a_rod(kind: str, speed: float) -> None:
    exact_omega = (np.arange(3) + 0.5) * np.pi * speed / L  # fixed-free rod
    errors = [clamped_frequencies(bar([kind], elements=n), 3) / exact_omega - 1 for n in (32, 64)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.05)  # linear elements, order 2
    assert (4 * errors[1] - errors[0]) / 3 == pytest.approx(0.0, abs=2e-5)


def test_stretch_with_a_tip_mass_solves_the_rods_equation() -> None:
    # tan(k L) k L = rod mass / tip mass
    ratio = MASS / 0.2
    wave = brentq(lambda x: x * np.tan(x) - ratio, 1e-6, np.pi / 2 - 1e-6)
    omega = clamped_frequencies(bar(["stretch"], elements=64, point_masses=tip_mass(0.2)), 1)
    assert omega == pytest.approx(wave / L * np.sqrt(E / RHO), rel=1e-4)


TIP_LOADS = [
    ("bend_y", 1, L**3 / (3 * E * BAR.I_z), 5, L**2 / (2 * E * BAR.I_z)),
    ("bend_z", 2, L**3 / (3 * E * BAR.I_y), 4, -(L**2) / (2 * E * BAR.I_y)),
    ("torsion", 3, L / (G * BAR.torsion_constant), 3, L / (G * BAR.torsion_constant)),
    ("stretch", 0, L / (E * A), 0, L / (E * A)),
]


@pytest.mark.parametrize("case", TIP_LOADS, ids=[case[0] for case in TIP_LOADS])
def test_tip_load_bends_as_the_textbook_says(case: tuple[str, int, float, int, float]) -> None:
    kind, load, deflection, other, turn = case
    mesh = BeamMesh(bar([kind], elements=3))
    _, K = mesh.matrices()
    free = np.setdiff1d(mesh.active, mesh.dof("root"))
    force, u = np.zeros(mesh.n_dof), np.zeros(mesh.n_dof)
    force[mesh.dof("end")[load]] = 1.0
    u[free] = np.linalg.solve(K[np.ix_(free, free)], force[free])
    assert u[mesh.dof("end")[[load, other]]] == pytest.approx([deflection, turn], rel=1e-10)


def test_curvature_is_exact_under_a_tip_load() -> None:
    mesh = BeamMesh(bar(["bend_y", "bend_z"], elements=3))
    _, K = mesh.matrices()
    free = np.setdiff1d(mesh.active, mesh.dof("root"))
    force, u = np.zeros(mesh.n_dof), np.zeros(mesh.n_dof)
    force[mesh.dof("end")[[1, 2]]] = 1.0
    u[free] = np.linalg.solve(K[np.ix_(free, free)], force[free])
    x = np.array([0.01, 0.2, 0.33])
    _, _, k_y, k_z = (mesh.deformation(x) @ u).T
    assert k_z == pytest.approx((L - x) / (E * BAR.I_z), rel=1e-9)
    assert k_y == pytest.approx((L - x) / (E * BAR.I_y), rel=1e-9)


def test_the_strain_of_modes_at_a_mesh_node_converges_at_least_with_order_two() -> None:
    """Curvatures are linear within an element; at its ends they are off by (k h)^2 / 12 of themselves."""
    exact = cantilever(E, BAR.I_z, RHO * A, L, 0.0, L, 3, RHO * BAR.I_z).shapes[1:]
    true = [[float(shape(x, 2) / shape(L)) for shape in exact] for x in (0.0, L / 2)]  # per metre at the tip
    off = []
    for n in (8, 16, 32):
        mesh = BeamMesh(bar(elements=n))
        free = np.setdiff1d(mesh.active, mesh.dof("root"))
        M, K = (matrix[np.ix_(free, free)] for matrix in mesh.matrices())
        u = np.zeros((mesh.n_dof, 2))
        u[free] = eigh(K, M)[1][:, 1:3]
        tip, bent = u[mesh.dof("end")[1]], mesh.deformation(np.array([L / 2]))[0, 3] @ u
        off.append(abs((bent / tip - true[1]) / true[0]))
    print(f"off at mid-beam in modes 2, 3, % of the root's strain: {(100 * np.array(off)).round(3).tolist()}")
    ratios = np.divide(off[:-1], off[1:])
    assert ratios[:, 0] == pytest.approx([4.0, 4.0], rel=0.1)
    assert (ratios[:, 1] > 4.0).all() and np.max(off[0]) < 0.02  # where mode 3 is symmetric, faster


def test_a_stepped_beam_equals_its_fine_mesh_of_equal_pieces() -> None:
    thin = replace(BAR, length=0.2, elements=4, I_z=BAR.I_z / 3, I_y=BAR.I_y / 2, area=BAR.area / 1.5)
    thick = replace(BAR, length=0.3, elements=6)
    kinds = ("bend_y", "bend_z", "torsion", "stretch")
    stepped = replace(bar(kinds), pieces=(thick, thin))
    parts = [
        replace(p, length=p.length / 3, elements=p.elements // 2) for p in (thick, thin) for _ in range(3)
    ]
    fine = replace(stepped, pieces=tuple(parts))
    # the finer mesh has 1.5 times the elements: linear elements (torsion, stretch) differ at order 2
    assert clamped_frequencies(stepped, 6) == pytest.approx(clamped_frequencies(fine, 6), rel=1e-3)
    assert clamped_frequencies(stepped, 2) == pytest.approx(clamped_frequencies(fine, 2), rel=1e-5)


def test_a_stepped_beam_bends_under_a_tip_load_by_the_sum_of_its_pieces() -> None:
    near, far = replace(BAR, length=0.3, elements=2), replace(BAR, length=0.2, elements=2, I_z=BAR.I_z / 4)
    mesh = BeamMesh(replace(bar(), pieces=(near, far)))
    _, K = mesh.matrices()
    free = np.setdiff1d(mesh.active, mesh.dof("root"))
    force = np.zeros(mesh.n_dof)
    force[mesh.dof("end")[1]] = 1.0
    u = np.linalg.solve(K[np.ix_(free, free)], force[free])[list(free).index(mesh.dof("end")[1])]
    energy = (0.5**3 - 0.2**3) / (3 * E * near.I_z) + 0.2**3 / (3 * E * far.I_z)  # int (L - x)^2 / EI dx
    assert u == pytest.approx(energy, rel=1e-10)


def test_rigid_motions_carry_the_whole_mass_and_store_no_energy() -> None:
    beam = bar(("bend_y", "bend_z", "torsion", "stretch"), point_masses=tip_mass(0.2, 0.35))
    mesh = BeamMesh(beam)
    M, K = mesh.matrices()
    x = mesh.nodes
    motion = np.zeros((6, x.size, 6))  # three translations, three rotations about the root
    motion[[0, 1, 2, 3, 4, 5], :, [0, 1, 2, 3, 4, 5]] = 1.0
    motion[4, :, 2], motion[5, :, 1] = -x, x
    rigid = motion.reshape(6, -1).T  # (n_dof, 6)
    total = MASS + 0.2
    about = MASS * L**2 / 3 + 0.2 * 0.35**2
    inertia = [total] * 3 + [RHO * J_P * L, about + RHO * BAR.I_y * L, about + RHO * BAR.I_z * L]
    first = MASS * L / 2 + 0.2 * 0.35
    expected = np.diag(inertia)
    expected[1, 5] = expected[5, 1] = first
    expected[2, 4] = expected[4, 2] = -first
    assert rigid.T @ M @ rigid == pytest.approx(expected, rel=1e-12, abs=1e-14)
    assert abs(K @ rigid).max() < 1e-9 * abs(K).max()


def test_the_mass_matrix_is_symmetric_and_positive() -> None:
    M, K = BeamMesh(bar(("bend_y", "bend_z", "torsion", "stretch"))).matrices()
    assert np.array_equal(M, M.T) or abs(M - M.T).max() < 1e-15
    assert np.linalg.eigvalsh(M).min() > 0
    assert np.linalg.eigvalsh(K).min() > -1e-9 * abs(K).max()
