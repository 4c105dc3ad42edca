"""Sparse reduction against dense solutions of the full, constrained problem."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from beam_theory import cantilever
from fe_bodies import ALUMINIUM, HEIGHT, LENGTH, WIDTH, block, bracket, ends, load_body, model
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import eigh

from flexarm_model.bodies.body_reduction import reduce_body
from flexarm_model.fe_import.interfaces import constrain, make_interface
from flexarm_model.fe_import.sparse_modes import Factor, count_below, lowest_modes, modes_below
from flexarm_model.manipulator.imported_body import ImportedBody, NodeSet

Array = NDArray[np.float64]

BOTH = {"root", "end"}


def constrained(body: ImportedBody, kinds: dict[str, str]) -> tuple[Array, Array, dict[str, Array]]:
    """Return dense M and K of the solid with its interfaces, root held, and the columns of the others."""
    solid = model(bracket())
    items = [
        make_interface(
            solid, name, NodeSet(kind, body.sets[name].index, body.sets[name].weight), body.nodes[name]
        )
        for name, kind in kinds.items()
    ]
    solid = type(solid)("solid", body.x, solid.M, solid.K, None)
    constraint = constrain(solid, items)
    T = constraint.T.toarray()
    free = np.setdiff1d(np.arange(T.shape[1]), constraint.columns["root"])
    T = T[:, free]
    columns = {
        name: np.searchsorted(free, index) for name, index in constraint.columns.items() if name != "root"
    }
    return T.T @ solid.M @ T, T.T @ solid.K @ T, columns


def imported(folder: Path, kind: str = "averaging", **reduction: object) -> ImportedBody:
    """Return the bracket with its interfaces at the files' origin and at the middle of the far face."""
    interfaces = {
        "root": {"set": "root.txt", "kind": "rigid", "at": ["0 m", "0 m", "0 m"]},
        "end": {"set": "end.txt", "kind": kind},
    }
    return load_body(
        folder, bracket(), interfaces=interfaces, reduction={"method": "craig_bampton", **reduction}
    )


@pytest.mark.parametrize("kind", ["rigid", "averaging"])
def test_guyan_answers_static_loads_on_the_interface_exactly(kind: str, tmp_path: Path) -> None:
    body = imported(tmp_path, kind, method="guyan")
    element = reduce_body(body, BOTH)
    _, K, columns = constrained(body, {"root": "rigid", "end": kind})
    node = element.nodes["end"]
    shapes = np.vstack([node.Phi, node.Psi])  # (6, n)
    compliance = shapes @ np.linalg.solve(element.K, shapes.T)
    assert element.n == 6
    assert compliance == pytest.approx(np.linalg.inv(K)[np.ix_(columns["end"], columns["end"])], rel=1e-7)


@pytest.mark.parametrize("kind", ["rigid", "averaging"])
def test_slow_frequencies_are_those_of_the_full_body(kind: str, tmp_path: Path) -> None:
    body = imported(tmp_path, kind, modes=40)
    M, K, _ = constrained(body, {"root": "rigid", "end": kind})
    exact = np.sqrt(eigh(K, M, eigvals_only=True, subset_by_index=(0, 9)))
    found = reduce_body(body, BOTH).omega[:10]
    assert found == pytest.approx(exact, rel=2e-3) and (found >= exact * (1 - 1e-9)).all()
    assert found[:3] == pytest.approx(exact[:3], rel=5e-5)


def test_frequencies_fall_with_the_number_of_modes(tmp_path: Path) -> None:
    found = [reduce_body(imported(tmp_path, modes=n), BOTH).omega[:4] for n in (7, 10, 16, 30)]
    assert (np.diff(found, axis=0) <= 1e-6).all() and found[0][0] > 1.0001 * found[-1][0]


def test_modes_of_a_held_body_without_another_interface_are_exact(tmp_path: Path) -> None:
    body = imported(tmp_path, modes=8)
    M, K, _ = constrained(body, {"root": "rigid"})
    exact = np.sqrt(eigh(K, M, eigvals_only=True, subset_by_index=(0, 7)))
    assert reduce_body(body, {"root"}).omega == pytest.approx(exact, rel=1e-9)


def test_f_max_keeps_the_static_modes_and_all_slower_ones(tmp_path: Path) -> None:
    body = imported(tmp_path, f_max="30 kHz")
    M, K, columns = constrained(body, {"root": "rigid", "end": "averaging"})
    inner = np.setdiff1d(np.arange(M.shape[0]), columns["end"])
    value = eigh(K[np.ix_(inner, inner)], M[np.ix_(inner, inner)], eigvals_only=True)
    slower = int((np.sqrt(value) < 2 * np.pi * 30e3).sum())
    assert slower > 3 and reduce_body(body, BOTH).n == 6 + slower


def test_modes_are_counted_by_the_signs_of_pivots() -> None:
    solid = bracket()
    value = eigh(solid.K.toarray(), solid.M.toarray(), eigvals_only=True)
    middle = np.sqrt((value[7:60:9] + value[8:61:9]) / 2)
    assert [count_below(solid.M, solid.K, omega) for omega in middle] == list(range(8, 62, 9))


def test_no_mode_below_a_frequency_is_missed_even_where_they_are_equal() -> None:
    """Two bodies side by side have every mode twice; Lanczos alone may find one of the two."""
    solid = bracket()
    held = [matrix[30:][:, 30:] for matrix in (solid.M, solid.K)]
    M, K = (sparse.block_diag([matrix, matrix], format="csr") for matrix in held)
    exact = eigh(held[1].toarray(), held[0].toarray(), eigvals_only=True)[:8]
    value, vector = modes_below(M, K, float(np.sqrt((exact[6] + exact[7]) / 2)))
    assert value == pytest.approx(np.repeat(exact[:7], 2), rel=1e-8)
    assert vector.T @ (M @ vector) == pytest.approx(np.eye(14), abs=1e-9)


def test_modes_of_a_free_body_come_from_a_negative_shift() -> None:
    solid = bracket()
    exact = eigh(solid.K.toarray(), solid.M.toarray(), eigvals_only=True)[:20]
    value, _ = lowest_modes(solid.M, solid.K, 20, -1e7)
    assert value == pytest.approx(exact, rel=1e-8, abs=1e-8 * exact[6])


def test_what_cannot_be_reduced_is_refused(tmp_path: Path) -> None:
    for used, reduction, expected in (
        ({"root"}, {"method": "guyan"}, "body 'solid': Guyan reduction needs an interface beside the root"),
        (BOTH, {"method": "guyan", "modes": 7}, "body 'solid': 7 modes asked for, 6 available"),
        (BOTH, {"modes": 900}, "body 'solid': 900 modes asked for, 129 available"),
    ):
        with pytest.raises(ValueError, match=expected):
            reduce_body(imported(tmp_path, **reduction), used)
    with pytest.raises(ValueError, match="singular"):
        Factor(sparse.csr_array((4, 4)))


def test_the_reduced_block_is_a_cantilever(tmp_path: Path) -> None:
    second, area, rho = WIDTH * HEIGHT**3 / 12, WIDTH * HEIGHT, ALUMINIUM.density
    exact = cantilever(ALUMINIUM.E, second, rho * area, LENGTH, 1e-12, LENGTH, 1, rho * second).omega[0]
    body = load_body(tmp_path, block(20, nu=0.0))
    assert reduce_body(body, BOTH).omega[0] == pytest.approx(exact, rel=2e-3)  # shear lowers it by 0.1 %
    assert ends(block(20))["end"].size == 9
    end = reduce_body(body, BOTH).nodes["end"]
    omega = reduce_body(body, BOTH).omega
    sag = end.Phi[2] @ (end.Phi[2] / omega**2)
    assert sag == pytest.approx(LENGTH**3 / (3 * ALUMINIUM.E * second), rel=2e-3)  # shear adds 0.1 %
