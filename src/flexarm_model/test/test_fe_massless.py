"""Bodies of beams and shells whose rotations bear no mass: lumped, as many programs write them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fe_beams import RIGID, bar_stiffness, strip
from fe_bodies import load_arm
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import eigh

from flexarm_model.bodies.body_reduction import reduce_body
from flexarm_model.bodies.model_order import with_more_modes
from flexarm_model.fe_import.checks import check_model
from flexarm_model.fe_import.fe_model import FeModel
from flexarm_model.fe_import.hexahedra import Solid
from flexarm_model.fe_import.imported_superelement import _modes
from flexarm_model.fe_import.interfaces import Constraint, constrain, make_interface
from flexarm_model.fe_import.sparse_modes import lowest_modes
from flexarm_model.manipulator.imported_body import ImportedReduction, NodeSet
from flexarm_model.numeric.rotation import skew

Array = NDArray[np.float64]
STEP, E, G, RHO = 0.05, 210e9, 81e9, 7850.0  # m, Pa, Pa, kg/m^3
SIDE = 0.01  # m, of the square bars


def bar(along: int) -> Array:
    """Return the stiffness of a bar along x or y, (12, 12)."""
    area, inertia, torsion, h = SIDE**2, SIDE**4 / 12, 0.141 * SIDE**4, STEP
    K = bar_stiffness(h, E * area, G * torsion, E * inertia, E * inertia)
    turn = np.eye(3) if along == 0 else np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    T = np.kron(np.eye(4), turn)
    return np.asarray(T @ K @ T.T)


def grillage(m: int) -> FeModel:
    """Return m by m nodes with bars between neighbours, their mass at the nodes."""
    x = np.array([(i * STEP, j * STEP, 0.0) for i in range(m) for j in range(m)])
    K, M = np.zeros((6 * m * m, 6 * m * m)), np.zeros(6 * m * m)
    for i in range(m):
        for j in range(m):
            for a, b, along in ((i + 1, j, 0), (i, j + 1, 1)):
                if a < m and b < m:
                    first, second = 6 * (i * m + j), 6 * (a * m + b)
                    index = np.r_[first : first + 6, second : second + 6]
                    K[np.ix_(index, index)] += bar(along)
                    for node in (first, second):
                        M[node : node + 3] += RHO * SIDE**2 * STEP / 2
    return FeModel("grid", x, sparse.diags_array(M).tocsr(), sparse.csr_array(K), None)


def held(model: FeModel, m: int) -> Constraint:
    """Return it with two edges as rigid interfaces."""
    sides = {"root": np.arange(m), "flange": np.arange(m * (m - 1), m * m)}
    return constrain(
        model,
        [
            make_interface(model, name, NodeSet("rigid", index, np.ones(m)), model.x[index].mean(axis=0))
            for name, index in sides.items()
        ],
    )


def exact(model: FeModel, constraint: Constraint) -> Array:
    """Return the squared frequencies with the root held, slowest first, of all that has mass."""
    free = np.setdiff1d(np.arange(constraint.T.shape[1]), constraint.columns["root"])
    T = constraint.T[:, free].toarray()
    mu = eigh(T.T @ model.M @ T, T.T @ model.K @ T, eigvals_only=True)[::-1]
    return np.asarray(1.0 / mu[mu > 1e-12 * mu[0]])


@pytest.mark.parametrize("m", [4, 9])
def test_a_flat_body_whose_rotations_bear_nothing_can_be_looked_at(m: int) -> None:
    """Its check ended with "the leading minor of order 13 of B", without a name."""
    found = check_model(grillage(m))
    assert found.problems == [] and found.n_rigid == 6
    assert found.rigid.mass == pytest.approx(2 * m * (m - 1) * RHO * SIDE**2 * STEP)


def test_modes_that_arpack_cannot_span_are_found_densely() -> None:
    """Nearly as many were asked for as have mass: a traceback of ARPACK."""
    model = grillage(3)
    shift = -1e6
    M, K = model.M.toarray(), model.K.toarray()
    mu = eigh(M, K - shift * M, eigvals_only=True)[::-1]
    for count in (8, 20, 27):
        squares, modes = lowest_modes(model.M, model.K, count, shift)
        np.testing.assert_allclose(squares - shift, 1.0 / mu[:count], rtol=1e-6)
        np.testing.assert_allclose(modes.T @ M @ modes, np.eye(count), atol=1e-6)
    with pytest.raises(ValueError, match="28 modes asked for, 27 have mass"):
        lowest_modes(model.M, model.K, 28, shift)


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])  # unit of length, which moves the rounding about
@pytest.mark.parametrize("n", [2, 4, 8])
def test_a_small_body_is_looked_at_though_few_of_its_displacements_have_mass(n: int, size: float) -> None:
    """More Lanczos vectors than have mass are noise: of four elements five modes were rigid, or none."""
    solid = strip(n, turning=False)
    tool = np.hstack([np.eye(3), -skew(np.array([0.0212345678, 0.0123456789, 0.0345678912]))])
    M, K = solid.M.toarray(), solid.K.toarray()
    M[-6:, -6:] += 0.3 * tool.T @ tool  # a mass with a lever, which turns with the strip
    exact = np.sqrt(1.0 / eigh(M, K + 1e4 * M, eigvals_only=True)[::-1][6:8] - 1e4) / (2 * np.pi)
    S = np.tile(np.repeat([1.0 / size, 1.0], 3), n + 1)
    M, K = (sparse.csr_array(S[:, None] * matrix * S) for matrix in (M, K))
    found = check_model(FeModel("solid", solid.x * size, M, K, None))
    assert found.problems == [] and found.n_rigid == 6
    assert found.elastic_hz[:2] == pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize("reduction", [{"modes": 30}, {"f_max": 40e3}])
def test_a_rotation_without_mass_of_its_own_is_named_and_takes_no_other_mode_with_it(
    reduction: dict[str, float],
) -> None:
    """A mode of 3e11 Hz came with a first one that was wrong by a third."""
    model = grillage(4)
    constraint = held(model, 4)
    few = ImportedReduction("craig_bampton", 8, 0.0)
    slowest = exact(model, constraint)[0]
    assert _modes(model, constraint, {"flange"}, few)[1][0] == pytest.approx(np.sqrt(slowest), rel=1e-3)
    named = (
        "rotation about y of interface 'flange' moves no mass of its own.* rotary inertia there, mesh finer"
    )
    said = "30 modes asked for, 29 available" if "modes" in reduction else named
    with pytest.raises(ValueError, match=said):
        _modes(model, constraint, {"flange"}, replace(few, **{"modes": 0, **reduction}))


@pytest.mark.parametrize("chosen", [{"modes": 6}, {"modes": 12}, {"f_max": 500.0}, {"f_max": 1e5}, "guyan"])
def test_fewer_modes_are_no_advice_where_static_modes_alone_move_no_mass(
    chosen: dict[str, float] | str,
) -> None:
    """A straight beam of lumped masses does not resist its own turn, however few modes are kept."""
    solid = strip(8, turning=False)
    model = FeModel("beam", solid.x, solid.M, solid.K, None)
    sets = {"root": np.array([0]), "flange": np.array([8])}
    made = [
        make_interface(model, name, NodeSet("rigid", nodes, np.ones(1)), solid.x[nodes[0]])
        for name, nodes in sets.items()
    ]
    few = ImportedReduction("craig_bampton", 0, 0.0)
    reduction = replace(few, method=chosen) if isinstance(chosen, str) else replace(few, **chosen)
    with pytest.raises(ValueError, match="^rotation about x of interface 'flange' .* rotary inertia there$"):
        _modes(model, constrain(model, made), {"flange"}, reduction)


@pytest.mark.parametrize("modes", [24, 29])
def test_modes_are_kept_as_many_as_have_mass_and_the_slowest_are_right(modes: int) -> None:
    """From 24 on they were refused, though 29 have mass. The static ones stay, at the cost of the fastest."""
    model = grillage(4)
    constraint = held(model, 4)
    exactly = np.sqrt(exact(model, constraint))
    omega = _modes(model, constraint, {"flange"}, ImportedReduction("craig_bampton", modes, 0.0))[1]
    assert exactly.size == 29 and omega.size == modes
    assert omega[:7] == pytest.approx(exactly[:7], rel=1e-3)
    assert omega[-1] <= exactly[-1] * (1 + 1e-6)


@pytest.mark.parametrize(("modes", "kept"), [(4, 7), (8, 11), (16, 16)])
def test_a_body_whose_rotations_bear_nothing_has_as_many_more_modes_as_have_mass(
    modes: int, kept: int, tmp_path: Path
) -> None:
    """A body that was served could not be simulated: of the rig's three more modes one moves no mass."""
    solid = strip(4)
    mass = solid.M.diagonal().reshape(-1, 6)
    mass[:, 4:] = 0.0
    lumped = Solid(solid.x, sparse.diags_array(mass.ravel()).tocsr(), solid.K)
    reduction = {"method": "craig_bampton", "modes": modes}
    config = load_arm(tmp_path, lumped, interfaces=RIGID, reduction=reduction)
    served, richer = (
        reduce_body(arm.bodies["solid"], {"root", "end"}) for arm in (config, with_more_modes(config, 3))
    )
    assert (served.n, richer.n) == (modes, kept)
    assert richer.omega[:3] == pytest.approx(served.omega[:3], rel=1e-3)
    if modes > 6:  # all static modes are among both
        ends = [body.nodes["end"].Phi / body.omega for body in (served, richer)]
        assert ends[1] @ ends[1].T == pytest.approx(ends[0] @ ends[0].T, rel=1e-9, abs=1e-12)  # m/N
