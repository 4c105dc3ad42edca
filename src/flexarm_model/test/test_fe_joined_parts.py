"""What the check says of bodies that elements alone do not hold together, and rigid interfaces do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fe_beams import RIGID, strip
from fe_bodies import block, load_body, write_arm
from scipy import sparse
from scipy.linalg import eigh

from flexarm_model.bodies.body_reduction import reduce_body
from flexarm_model.fe_import.__main__ import main
from flexarm_model.fe_import.checks import check_model
from flexarm_model.fe_import.fe_model import FeModel, load_model
from flexarm_model.fe_import.hexahedra import Solid
from flexarm_model.fe_import.interfaces import Interface, constrain, make_interface
from flexarm_model.manipulator.imported_body import ImportedBody
from flexarm_model.reading.config import load_config

AVERAGING = {name: {"set": f"{name}.txt", "kind": "averaging"} for name in ("root", "end")}


def with_tool(mass: float) -> Solid:
    """Return a block with a node on its far face that nothing but the interface holds."""
    solid = block(6)
    x = np.vstack([solid.x, [solid.x[:, 0].max(), 0.003, 0.002]])
    n = solid.M.shape[0]
    K = sparse.block_diag([solid.K, sparse.csr_array((3, 3))], format="csr")
    return Solid(
        x, sparse.block_diag([solid.M, mass * sparse.eye_array(3)], format="csr"), K[: n + 3, : n + 3]
    )


def two_blocks() -> Solid:
    """Return two blocks side by side."""
    solid = block(4)
    M, K = (sparse.block_diag([matrix] * 2, format="csr") for matrix in (solid.M, solid.K))
    return Solid(np.vstack([solid.x, solid.x + [0.0, 0.05, 0.01]]), M, K)


def rigid(body: ImportedBody) -> tuple[FeModel, list[Interface]]:
    """Return what is read of a body, and its rigid interfaces."""
    model = load_model(body)
    sets = {name: nodes for name, nodes in body.sets.items() if nodes.kind == "rigid"}
    return model, [make_interface(model, name, nodes, body.nodes[name]) for name, nodes in sets.items()]


@pytest.mark.parametrize("solid", [with_tool(0.2), with_tool(0.0), two_blocks()], ids=["mass", "idle", "two"])
def test_rigid_interfaces_hold_together_what_elements_do_not(solid: Solid, tmp_path: Path) -> None:
    """A tool's mass on a flange's reference node made three more: exit code 1 for a sound body."""
    body = load_body(tmp_path, solid, interfaces=RIGID)
    assert main([str(tmp_path / "arm.yaml"), "solid"]) == 0
    model, interfaces = rigid(body)
    found = check_model(model, interfaces)
    assert found.problems == [] and found.n_rigid == 6
    alone = found.n_dof < model.M.shape[0]  # an idle node is no part of the body
    assert found.is_joined != alone
    T = np.eye(found.n_dof) if alone else constrain(model, interfaces).T.toarray()
    M, K = (A[: T.shape[0], : T.shape[0]].toarray() for A in (model.M, model.K))
    exact = np.sqrt(eigh(T.T @ K @ T, T.T @ M @ T, eigvals_only=True)[6:9]) / (2 * np.pi)
    assert found.elastic_hz[:3] == pytest.approx(exact, rel=1e-6)


def test_a_sound_body_is_looked_at_alone_whatever_its_interfaces(tmp_path: Path) -> None:
    """Its frequencies are those of the other program, whose free body knows no interfaces."""
    solid = block(6)
    found = check_model(*rigid(load_body(tmp_path, solid, interfaces=RIGID)))
    alone = check_model(FeModel("solid", solid.x, solid.M, solid.K, None))
    assert not found.is_joined and found.elastic_hz == pytest.approx(alone.elastic_hz, rel=1e-9)


def test_parts_that_no_rigid_interface_joins_are_counted_up_to_the_last_mode_looked_at(
    tmp_path: Path,
) -> None:
    """Two parts have twelve rigid modes; ten were said, of ten that are looked at."""
    said = "at least 10 modes of the free body have no stiffness; expected the 6 rigid ones"
    model, none = rigid(load_body(tmp_path, two_blocks(), interfaces=AVERAGING))
    found = check_model(model, none)
    assert found.problems == [said] and "rigid modes                      at least 10\n" in found.text()


@pytest.mark.parametrize("move", [[0.03, 0.1, 0.0], [0.05, 0.0, 0.2]])
def test_parts_that_nothing_joins_are_told_from_supports(move: list[float], tmp_path: Path) -> None:
    """A stiffness of rounding above 0 was a support: 0.001 Hz, half of it rigid motion that was resisted."""
    solid = two_blocks()
    solid.x[solid.x.shape[0] // 2 :] += move  # out of the planes of the interfaces
    with pytest.raises(ValueError, match="body 'solid': the stiffness lets a mode move freely .* one piece"):
        reduce_body(load_body(tmp_path, solid, interfaces=RIGID), {"root", "end"})


def test_displacements_that_are_empty_on_a_rigid_face_are_no_loose_ones(tmp_path: Path) -> None:
    """Of a node without rotary stiffness the reduction took no notice, and the check refused it."""
    solid = strip(8)
    M, K = (matrix.tolil() for matrix in (solid.M, solid.K))
    x = np.vstack([solid.x, [solid.x[-1]]])  # a second node at the end, tied to it by a spring alone
    n = M.shape[0]
    M.resize((n + 6, n + 6)), K.resize((n + 6, n + 6))
    for k in range(3):
        pair = np.ix_([n - 6 + k, n + k], [n - 6 + k, n + k])
        K[pair] = K[pair].toarray() + 1e5 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    path = write_arm(tmp_path, Solid(x, M.tocsr(), K.tocsr()), interfaces=RIGID)
    assert main([str(path), "solid"]) == 0
    assert reduce_body(load_config(path).bodies["solid"], {"root", "end"}).n == 10
