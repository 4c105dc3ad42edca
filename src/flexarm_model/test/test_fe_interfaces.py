"""Interface nodes: what rigid and averaging sets must do to any motion and any force."""

from __future__ import annotations

import numpy as np
import pytest
from fe_bodies import bracket, ends, model
from numpy.typing import NDArray
from scipy.linalg import eigh

from flexarm_model.fe_import.fe_model import FeModel
from flexarm_model.fe_import.interfaces import Interface, constrain, make_interface
from flexarm_model.manipulator.imported_body import NodeSet

Array = NDArray[np.float64]

AT = np.array([0.01, -0.02, 0.03])
KINDS = ["rigid", "averaging"]


@pytest.fixture(scope="module")
def body() -> FeModel:
    return model(bracket())


def interface(body: FeModel, end: str, kind: str, at: Array = AT, weight: Array | None = None) -> Interface:
    index = ends(bracket())[end] - 1
    weights = np.ones(index.size) if weight is None else weight
    return make_interface(body, end, NodeSet(kind, index, weights), at)


def frequencies(body: FeModel, T: Array) -> Array:
    K, M = T.T @ body.K @ T, T.T @ body.M @ T
    return np.sqrt(np.maximum(eigh(K, M, eigvals_only=True), 0.0))


@pytest.mark.parametrize("kind", KINDS)
def test_an_interface_follows_a_rigid_motion_of_its_nodes(body: FeModel, kind: str) -> None:
    item = interface(body, "root", kind, weight=np.linspace(1, 3, ends(bracket())["root"].size))
    assert pytest.approx(np.eye(6), abs=1e-12) == item.A @ item.R


def test_the_mean_of_an_interface_is_a_least_squares_fit(body: FeModel) -> None:
    item = interface(body, "end", "averaging")
    u = np.random.default_rng(2).standard_normal(item.dof.size)
    best = np.linalg.lstsq(item.R, u, rcond=None)[0]
    assert item.A @ u == pytest.approx(best, abs=1e-9 * abs(best).max())


def test_a_force_on_an_averaging_interface_keeps_its_resultant(body: FeModel) -> None:
    item = interface(body, "end", "averaging", weight=np.arange(1.0, 7.0))
    force = np.array([1.0, -2.0, 3.0, 0.5, 0.1, -0.2])  # and moment about the node
    nodal = (item.A.T @ force).reshape(-1, 3)
    lever = body.x[item.dof[::3] // 3] - AT
    assert nodal.sum(axis=0) == pytest.approx(force[:3], abs=1e-12)
    assert np.cross(lever, nodal).sum(axis=0) == pytest.approx(force[3:], abs=1e-12)


def test_weights_say_which_nodes_bear_a_force(body: FeModel) -> None:
    weight = np.full(6, 1e-6)
    weight[[0, 3, 4]] = 1.0
    item = interface(body, "end", "averaging", weight=weight)
    share = abs((item.A.T @ np.array([0, 0, 1.0, 0, 0, 0])).reshape(-1, 3)).max(axis=1)
    assert share[weight < 1].max() < 1e-4 * share[weight == 1].min()


def test_the_constraint_reproduces_rigid_motion(body: FeModel) -> None:
    items = [interface(body, "root", "rigid"), interface(body, "end", "averaging", at=-AT)]
    constraint = constrain(body, items)
    motion = body.rigid_motion()
    q = np.zeros((constraint.T.shape[1], 6))
    free = np.setdiff1d(np.arange(body.M.shape[0]), items[0].dof)
    inside = constraint.T[:, :-12].tocoo()
    unit = inside.data == 1.0
    q[inside.col[unit]] = motion[inside.row[unit]]
    for item, at in zip(items, (AT, -AT), strict=True):
        q[constraint.columns[item.name], :3] = np.eye(6)[:, :3]
        turn = np.array([[0, at[2], -at[1]], [-at[2], 0, at[0]], [at[1], -at[0], 0]])
        q[constraint.columns[item.name], 3:] = np.vstack([turn, np.eye(3)])
    assert constraint.T @ q == pytest.approx(motion, abs=1e-12)
    assert free.size + 6 == constraint.T.shape[1]


def test_an_averaging_interface_stiffens_nothing(body: FeModel) -> None:
    T = constrain(body, [interface(body, "end", "averaging")]).T.toarray()
    assert T.shape == (body.M.shape[0],) * 2
    free = frequencies(body, np.eye(body.M.shape[0]))
    assert frequencies(body, T)[6:] == pytest.approx(free[6:], rel=1e-6)


def test_a_rigid_interface_stiffens_and_keeps_six_rigid_modes(body: FeModel) -> None:
    T = constrain(body, [interface(body, "end", "rigid")]).T.toarray()
    free, stiffer = frequencies(body, np.eye(body.M.shape[0])), frequencies(body, T)
    assert (stiffer[:6] < 1e-2 * stiffer[6]).all()
    assert (stiffer[6:] >= free[6 : stiffer.size] * (1 - 1e-9)).all() and stiffer[10] > 1.001 * free[10]


def test_interface_coordinates_are_what_the_mean_says(body: FeModel) -> None:
    """T and A are inverse to each other on every motion that the interfaces allow."""
    items = [interface(body, "root", "averaging"), interface(body, "end", "rigid", at=-AT)]
    constraint = constrain(body, items)
    q = np.random.default_rng(3).standard_normal(constraint.T.shape[1])
    u = constraint.T @ q
    for item in items:
        assert item.A @ u[item.dof] == pytest.approx(q[constraint.columns[item.name]], abs=1e-11)


def test_sets_that_tell_no_rotation_are_refused(body: FeModel) -> None:
    line = np.flatnonzero((abs(body.x[:, 1]) < 1e-9) & (abs(body.x[:, 2]) < 1e-9))
    for index in (line, line[:1]):
        with pytest.raises(
            ValueError, match=f"body 'solid': interface 'edge': its {index.size} nodes tell no rot"
        ):
            make_interface(body, "edge", NodeSet("rigid", index, np.ones(index.size)), AT)
    with pytest.raises(ValueError, match="its 1 nodes tell no rotation; they lie on it; expected three"):
        make_interface(body, "edge", NodeSet("rigid", line[:1], np.ones(1)), body.x[line[0]])


@pytest.mark.parametrize("size", [1e-9, 1e-6, 1.0, 1e6])
def test_a_set_tells_a_rotation_whatever_its_size(size: float) -> None:
    corners = size * np.array([[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]])
    solid = FeModel("solid", corners, np.eye(9), np.eye(9), None)
    nodes = NodeSet("rigid", np.arange(3), np.ones(3))
    item = make_interface(solid, "face", nodes, np.zeros(3))
    unit = np.repeat([1.0, 1 / size], 3)
    assert pytest.approx(np.eye(6), abs=1e-12) == (item.A @ item.R) * unit / unit[:, None]


def test_a_set_that_lies_on_a_line_but_for_rounding_tells_none() -> None:
    line = np.array([[0.0, 0, 0], [1.0, 0, 0], [2.0, 1e-12, 0]])
    solid = FeModel("solid", line, np.eye(9), np.eye(9), None)
    nodes = NodeSet("rigid", np.arange(3), np.ones(3))
    with pytest.raises(ValueError, match=r"no rotation; 1\.29 m is their usual distance .*of the files"):
        make_interface(solid, "edge", nodes, np.zeros(3))


def test_a_node_with_rotations_is_an_interface_by_itself() -> None:
    x = np.array([[0.0, 0, 0], [1.0, 0, 0]])
    shell = FeModel("shell", x, np.eye(12), np.eye(12), None)
    item = make_interface(shell, "tip", NodeSet("rigid", np.array([1]), np.ones(1)), np.array([1.5, 0, 0]))
    assert pytest.approx(np.eye(6), abs=1e-12) == item.A @ item.R
    assert item.R[1] == pytest.approx([0, 1, 0, 0, 0, -0.5])


@pytest.mark.parametrize("off", [1e-17, 1e-12, 1e-6, 1e-3])
@pytest.mark.parametrize("kind", KINDS)
def test_a_node_that_lies_on_its_interface_but_for_rounding_tells_its_own_rotation(
    kind: str, off: float
) -> None:
    """Rounding of its place, of 1e-17 m, was taken for the lever of its displacements, as large as they."""
    x = np.array([[0.0, 0, 0], [0.5, 0, 0]])
    shell = FeModel("shell", x, np.eye(12), np.eye(12), None)
    at = x[1] + off * np.array([0.3, -0.5, 0.8])
    item = make_interface(shell, "tip", NodeSet(kind, np.array([1]), np.ones(1)), at)
    assert item.A[3:] == pytest.approx(np.hstack([np.zeros((3, 3)), np.eye(3)]), abs=1e-9)
    assert pytest.approx(np.eye(6), abs=1e-9) == item.A @ item.R


def test_nodes_that_coincide_but_for_rounding_tell_no_rotation() -> None:
    place = np.array([0.1, 0.2, 0.3])
    x = np.vstack([np.zeros(3), place, place, place + [1e-17, 0, 0]])
    x[2, 1] = np.nextafter(x[2, 1], 1.0)
    solid = FeModel("solid", x, np.eye(12), np.eye(12), None)
    with pytest.raises(ValueError, match="its 3 nodes tell no rotation"):
        make_interface(solid, "face", NodeSet("rigid", np.arange(1, 4), np.ones(3)), np.nextafter(place, 0.0))


def test_interfaces_that_share_a_node_are_refused(body: FeModel) -> None:
    items = [interface(body, "root", kind) for kind in KINDS]
    with pytest.raises(ValueError, match="body 'solid': interfaces 'root' and 'root' share a node"):
        constrain(body, items)
