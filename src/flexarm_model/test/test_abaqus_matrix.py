"""Matrices of Abaqus that name nodes and degrees of freedom: the same as by row and column, or refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fe_bodies import block, ends, load_body
from scipy import sparse

from flexarm_model.fe_import.abaqus_matrix import NodeOrder, read_abaqus
from flexarm_model.fe_import.fe_model import load_model
from flexarm_model.fe_import.matrix_file import read_matrix
from flexarm_model.manipulator.imported_body import MatrixFile
from flexarm_model.reading.config import load_config
from flexarm_model.settings.strict_yaml import ConfigError

LABELS = np.array([30, 7, 11])  # the order of the coordinates, not that of their numbers
FIRST = "7,1, 7,1, 4.0\n"


def write_by_nodes(path: Path, matrix: Any, labels: np.ndarray, kept: str = "lower") -> None:
    """Write a matrix over nodes as Abaqus does: by ascending labels, one triangle of that order or both."""
    entries, per_node = sparse.coo_array(matrix), matrix.shape[0] // labels.size
    lines = []
    for i, j, value in zip(entries.row, entries.col, entries.data, strict=True):
        row, column = ((int(labels[at // per_node]), int(at % per_node) + 1) for at in (i, j))
        if kept == "both" or (row >= column if kept == "lower" else row <= column):
            lines.append((row, column, f"{row[0]},{row[1]}, {column[0]},{column[1]}, {value:.17e}"))
    heading = "** of a free body\n*MATRIX INPUT, NAME=A\n"
    path.write_text(heading + "\n".join(line for *_, line in sorted(lines)), encoding="utf-8")


def symmetric(n: int) -> np.ndarray:
    """Return a matrix of which about half of the entries are zero, (n, n)."""
    rng = np.random.default_rng(3)
    A = rng.standard_normal((n, n)) * (rng.random((n, n)) < 0.3)
    return np.asarray(A + A.T + 5 * np.eye(n))


def read(path: Path, content: str, order: NodeOrder | None = None) -> np.ndarray:
    path.write_text(content, encoding="utf-8")
    return np.asarray(read_matrix(MatrixFile(path), order or NodeOrder(LABELS)).toarray())


@pytest.mark.parametrize("kept", ["lower", "upper", "both"])
@pytest.mark.parametrize("per_node", [3, 6])
def test_names_of_nodes_put_rows_in_the_order_of_the_coordinates(
    per_node: int, kept: str, tmp_path: Path
) -> None:
    A = symmetric(per_node * LABELS.size)
    write_by_nodes(tmp_path / "k.mtx", A, LABELS, kept)
    assert np.array_equal(read_matrix(MatrixFile(tmp_path / "k.mtx"), NodeOrder(LABELS)).toarray(), A)


def test_a_body_is_the_same_in_both_forms(tmp_path: Path) -> None:
    """Of Abaqus' default the first line was refused."""
    solid = block(2)
    by_rows = load_model(load_body(tmp_path, solid, ".abaqus.mtx"))
    labels = np.random.default_rng(1).permutation(solid.x.shape[0]) + 101
    path = tmp_path / "arm.yaml"
    np.savetxt(tmp_path / "nodes.csv", np.column_stack([labels, solid.x]), fmt=["%d", *["%.17g"] * 3])
    for name, chosen in ends(solid).items():
        np.savetxt(tmp_path / f"{name}.txt", labels[chosen - 1], fmt="%d")
    for name, matrix in (("mass", solid.M), ("stiffness", solid.K)):
        write_by_nodes(tmp_path / f"{name}.abaqus.mtx", matrix, labels)
    by_nodes = load_model(load_config(path).bodies["solid"])
    for key in ("M", "K"):
        named, counted = getattr(by_nodes, key), getattr(by_rows, key)
        assert abs(named - counted).max() <= 1e-15 * abs(counted).max()  # its triangles differ by rounding


def test_what_is_left_out_is_zero_and_a_mass_has_the_rotations_of_its_stiffness(tmp_path: Path) -> None:
    found = read(tmp_path / "m.mtx", FIRST, NodeOrder(LABELS, 6))
    assert found.shape == (18, 18) and found[6, 6] == 4.0 and np.count_nonzero(found) == 1
    assert read(tmp_path / "m.mtx", FIRST).shape == (9, 9)


WRONG = [
    ("a node that is not there", FIRST + "8,1, 8,1, 4.0\n", ("node label 8", "3 labels from 7 to 30")),
    ("an internal node", FIRST + "-2000001,1, -2000001,1, 4.0\n", ("node -2000001", "Lagrange multiplier")),
    ("a temperature", FIRST + "11,11, 11,11, 4.0\n", ("node 11: degree of freedom 11: expected 1 to 6",)),
    ("no degree of freedom", FIRST + "11,0, 11,1, 4.0\n", ("degree of freedom 0", "from 1")),
    ("rows below names", FIRST + "2, 2, 4.0\n", ("line 2", "'2  2  4.0'", "FORMAT=MATRIX INPUT")),
    ("names below rows", "1, 1, 4.0\n" + FIRST, ("line 2", "FORMAT=COORDINATE")),
    ("two matrices", f"*MATRIX INPUT, NAME=K\n{FIRST}*matrix input, name=M\n{FIRST}", ("line 3", "second")),
    ("a factor", f"*MATRIX INPUT, NAME=K, SCALE FACTOR=2\n{FIRST}", ("line 1", "a scale factor")),
]


@pytest.mark.parametrize("case", WRONG, ids=[case[0] for case in WRONG])
def test_what_names_of_nodes_do_not_say_is_refused(
    case: tuple[str, str, tuple[str, ...]], tmp_path: Path
) -> None:
    with pytest.raises(ConfigError) as caught:
        read(tmp_path / "k.mtx", case[1])
    for fragment in (str(tmp_path / "k.mtx"), *case[2]):
        assert fragment in str(caught.value)


def test_a_rotation_that_the_stiffness_has_not_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="node 7: degree of freedom 4: expected 1 to 3 .* as the stiffness"):
        read(tmp_path / "m.mtx", "7,4, 7,4, 1.0\n", NodeOrder(LABELS, 3))
    with pytest.raises(ConfigError, match=r"names nodes, of which nothing is known here; expected row, col"):
        read_abaqus(tmp_path / "m.mtx", None)


def test_names_of_nodes_are_not_mixed_with_another_order_of_rows(tmp_path: Path) -> None:
    solid = block(2)
    body, labels = load_body(tmp_path, solid, ".abaqus.mtx"), np.arange(1, solid.x.shape[0] + 1)
    write_by_nodes(tmp_path / "stiffness.abaqus.mtx", solid.K, labels)
    with pytest.raises(ConfigError, match=r"mass\.abaqus\.mtx: does not name .*ness\.abaqus\.mtx does"):
        load_model(body)
    write_by_nodes(tmp_path / "mass.abaqus.mtx", solid.M, labels)
    with pytest.raises(ConfigError, match=r"stiffness\.abaqus\.mtx: names the nodes .* leave 'rows' out"):
        load_model(replace(body, rows=np.arange(3 * labels.size)))
