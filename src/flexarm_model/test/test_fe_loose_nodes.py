"""Imported bodies with nodes that nothing holds, and with rigid motions that move no mass."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from fe_beams import LENGTH, RIGID, load_strip, strip
from fe_bodies import block, load_body, write_arm
from scipy import sparse

from flexarm_model.bodies.body_reduction import reduce_body
from flexarm_model.fe_import.__main__ import main
from flexarm_model.fe_import.checks import check_model
from flexarm_model.fe_import.fe_model import FeModel, load_model
from flexarm_model.fe_import.hexahedra import Solid
from flexarm_model.manipulator.imported_body import ImportedBody
from flexarm_model.reading.config import load_config
from flexarm_model.settings.strict_yaml import ConfigError

BOTH = {"root", "end"}


def with_loose_node(solid: Solid) -> Solid:
    """Return a solid and a node in its middle that belongs to no element."""
    x = np.vstack([[[LENGTH / 2, 0.0, 0.0]], solid.x])
    M, K = (
        sparse.block_diag([sparse.csr_array((6, 6)), matrix], format="csr") for matrix in (solid.M, solid.K)
    )
    return Solid(x, M, K)


def load(folder: Path, solid: Solid, root: str, end: str) -> ImportedBody:
    """Load a solid with rigid interfaces of these nodes; its first node is labelled 500."""
    for name, labels in (("first", root), ("last", end)):
        (folder / f"{name}.txt").write_text(labels, encoding="utf-8")
    sets = {"root": "first.txt", "end": "last.txt"}
    interfaces = {name: {"set": file, "kind": "rigid"} for name, file in sets.items()}
    path = write_arm(folder, solid, interfaces=interfaces)
    nodes = folder / "nodes.csv"
    nodes.write_text(nodes.read_text(encoding="utf-8").replace("\n1,", "\n500,"), encoding="utf-8")
    body = load_config(path).bodies["solid"]
    assert isinstance(body, ImportedBody)
    return body


def test_a_node_that_nothing_holds_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The matrix was called singular, without a node."""
    body = load(tmp_path, with_loose_node(strip(4)), "2", "6")
    said = r"body 'solid': .*stiffness\.mtx: node 500: ux, uy, uz, rx, ry, rz: no stiffness holds them"
    with pytest.raises(ValueError, match=said):
        reduce_body(body, BOTH)
    assert main([str(tmp_path / "arm.yaml"), "solid"]) == 2
    assert re.search(said, capsys.readouterr().err)


def test_a_node_that_a_rigid_interface_takes_along_needs_no_stiffness(tmp_path: Path) -> None:
    """The check refused it, and advised to do what was done."""
    held = reduce_body(load(tmp_path, with_loose_node(strip(4)), "2", "500\n6"), BOTH)
    assert main([str(tmp_path / "arm.yaml"), "solid"]) == 0
    assert held.omega == pytest.approx(reduce_body(load_strip(tmp_path, strip(4)), BOTH).omega, rel=1e-6)


@pytest.mark.parametrize(("mass", "advice"), [(0.0, "set of a rigid interface$"), (0.2, "its mass can be a")])
def test_a_node_that_nothing_holds_is_named_in_an_averaging_set_too(
    mass: float, advice: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The mean couples it to others: an interface was to move no mass, or the body was supported."""
    solid = block(4)
    M, K = (
        sparse.block_diag([matrix, own * sparse.eye_array(3)], format="csr")
        for matrix, own in ((solid.M, mass), (solid.K, 0.0))
    )
    x = np.vstack([solid.x, [solid.x[:, 0].max(), 0.003, 0.002]])
    body = load_body(tmp_path, Solid(x, M, K))  # its end is an averaging interface
    assert body.sets["end"].index.size == 10
    said = rf"body 'solid': .*mtx: node {x.shape[0]}: ux, uy, uz: no stiffness holds them.*{advice}"
    with pytest.raises(ValueError, match=said):
        reduce_body(body, BOTH)
    assert main([str(tmp_path / "arm.yaml"), "solid"]) == 2
    assert re.search(said, capsys.readouterr().err.strip())


@pytest.mark.parametrize("loose", [1, 2])
def test_an_abaqus_stiffness_may_end_before_a_loose_node_of_a_rigid_interface(
    loose: int, tmp_path: Path
) -> None:
    """Abaqus writes no zeros and no size: such a node was fine in other formats, and here refused."""
    solid = strip(4)
    empty = sparse.csr_array((6 * loose, 6 * loose))
    M, K = (sparse.block_diag([matrix, empty], format="csr") for matrix in (solid.M, solid.K))
    x = np.vstack([solid.x, np.tile([[LENGTH, 0.01, 0.0]], (loose, 1))])
    held = load_body(tmp_path, Solid(x, M, K), ".abaqus.mtx", interfaces=RIGID)  # the nodes at either end
    assert [nodes.index.size for nodes in held.sets.values()] == [1, 1 + loose]
    found = reduce_body(held, BOTH)
    exact = reduce_body(load_strip(tmp_path, solid), BOTH)
    assert found.omega == pytest.approx(exact.omega, rel=1e-6)


def test_a_stiffness_that_ends_before_other_nodes_is_refused_by_its_size(tmp_path: Path) -> None:
    solid = strip(4)
    x = np.vstack([solid.x, [[LENGTH / 2, 0.01, 0.0]]])
    K = sparse.block_diag([solid.K, sparse.csr_array((6, 6))], format="csr")
    with pytest.raises(
        ConfigError, match=r"stiffness\.abaqus\.mtx: has 30 rows; expected 18 or 36 .* 6 nodes"
    ):
        load_model(load_body(tmp_path, Solid(x, K, K), ".abaqus.mtx", interfaces=RIGID))


@pytest.mark.parametrize("turn", [np.eye(3), np.array([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1.0]])])
def test_a_straight_beam_whose_nodes_bear_no_rotary_inertia_is_looked_at(turn: np.ndarray) -> None:
    """Nothing turns with it about its own axis: its check ended with a singular matrix."""
    solid = strip(20, turning=False)
    T = sparse.kron(sparse.eye_array(2 * solid.x.shape[0]), turn, format="csr")
    model = FeModel("solid", solid.x @ turn.T, T @ solid.M @ T.T, T @ solid.K @ T.T, None)
    found = check_model(model)
    assert found.problems == [] and found.n_rigid == 6
    axis = "x" if turn[0, 0] == 1.0 else r"[0.6, 0.8, 0]"
    assert found.suspicions == [
        f"its rotation about {axis} moves no mass: give nodes rotary inertia if a joint turns it that way"
    ]
    heavy = check_model(FeModel("solid", strip(20).x, strip(20).M, strip(20).K, None))
    assert found.elastic_hz[:3] == pytest.approx(heavy.elastic_hz[:3], rel=2e-3)  # of rotary inertia
    assert heavy.suspicions == []
