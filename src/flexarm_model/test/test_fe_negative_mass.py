"""Bodies whose mass matrix gives some motion a negative mass, and files that make one of a sound matrix."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fe_beams import strip
from fe_bodies import bracket, load_body, model
from scipy import io, sparse
from scipy.linalg import eigvalsh

from flexarm_model.bodies.body_reduction import reduce_body
from flexarm_model.fe_import.checks import check_model, refuse_unsound
from flexarm_model.fe_import.fe_model import FeModel
from flexarm_model.fe_import.matrix_file import read_matrix
from flexarm_model.manipulator.imported_body import MatrixFile
from flexarm_model.numeric.rotation import skew
from flexarm_model.settings.strict_yaml import ConfigError

BOTH = {"root", "end"}
HEADING = "%%MatrixMarket matrix coordinate real symmetric\n"


def with_negative_nodes() -> FeModel:
    """Return a body of which two nodes have a negative mass and a third bears it, as row sums make them."""
    solid = bracket(lumped=True)
    mass = solid.M.diagonal().reshape(-1, 3)
    mass[5] += 4.0 * (mass[3] + mass[8])
    mass[[3, 8]] *= -3.0
    return replace(model(solid), M=sparse.diags_array(mass.ravel()).tocsr())


def with_heavy_sides() -> FeModel:
    """Return a body of whose mass the entries beside the diagonal count twice."""
    sound = model(bracket())
    return replace(sound, M=(2.0 * sound.M - sparse.diags_array(sound.M.diagonal())).tocsr())


@pytest.mark.parametrize("body", [with_negative_nodes(), with_heavy_sides()], ids=["nodes", "sides"])
def test_a_mass_that_some_motion_turns_negative_is_refused_by_name(body: FeModel, tmp_path: Path) -> None:
    """It passed with a third mode that was wrong by half, or was said to have a massless interface."""
    count = int((eigvalsh(body.M.toarray()) < 0.0).sum())
    said = f"the mass has {count} negative eigenvalues; expected none"
    assert count >= 6
    with pytest.raises(ValueError, match=f"body 'solid': {said}"):
        refuse_unsound(body)
    found = check_model(body)
    assert found.n_negative[0] == count
    assert len(found.problems) == 1 and said in found.problems[0]  # and nothing of a sound stiffness
    file = load_body(tmp_path, bracket())
    io.mmwrite(file.mass.path, body.M)
    with pytest.raises(ValueError, match=said):
        reduce_body(file, BOTH)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])  # unit of length: rotations are no translations
def test_a_massless_motion_is_not_negative_by_digits_or_units(scale: float) -> None:
    """A tool beside its node, as a mass with a lever, turns about itself without mass, but for rounding."""
    solid = strip(20, turning=False)
    tool = np.hstack([np.eye(3), -skew(np.array([0.0212345678, 0.0123456789, 0.0345678912]))])
    M = solid.M.toarray()
    M[-6:, -6:] += 0.314159265 * tool.T @ tool
    S = np.tile(np.repeat([1.0 / scale, 1.0], 3), solid.x.shape[0])
    M, K = (S[:, None] * matrix * S for matrix in (M, solid.K.toarray()))
    M = np.array([[float(f"{entry:.6e}") for entry in row] for row in M])
    assert np.linalg.eigvalsh(M / S[:, None] / S)[0] < -1e-12 * abs(M / S[:, None] / S).max()
    body = FeModel("solid", solid.x * scale, sparse.csr_array(M), sparse.csr_array(K), None)
    refuse_unsound(body)
    assert check_model(body).problems == []


def entries(matrix: np.ndarray) -> str:
    """Return the lines of a Matrix Market file below its heading."""
    index = np.argwhere(matrix)
    n = matrix.shape[0]
    lines = [f"{i + 1} {j + 1} {float(matrix[i, j])!r}" for i, j in index]
    return "\n".join([f"{n} {n} {len(lines)}", *lines, ""])


A = np.array([[4.0, -1.0, 0.0], [-1.0, 5.0, 0.1], [0.0, 0.1, 6.0]])


@pytest.mark.parametrize("heading", [HEADING, HEADING.replace("symmetric", "SYMMETRIC")])
def test_both_triangles_under_the_heading_symmetric_are_refused(heading: str, tmp_path: Path) -> None:
    """Each entry and its mirror image were added: 0.268 kg were read of 0.216."""
    path = tmp_path / "mass.mtx"
    path.write_text(heading + entries(A), encoding="utf-8")
    with pytest.raises(ConfigError, match=r"mass\.mtx: line 1: is headed symmetric, and entries .* general"):
        read_matrix(MatrixFile(path))


@pytest.mark.parametrize("triangle", [np.tril(A), np.triu(A), np.diag(np.diag(A))], ids=["low", "up", "no"])
def test_either_triangle_under_the_heading_symmetric_is_the_whole(
    triangle: np.ndarray, tmp_path: Path
) -> None:
    path = tmp_path / "mass.mtx"
    path.write_text(HEADING + entries(triangle), encoding="utf-8")
    expected = triangle + triangle.T - np.diag(np.diag(A))
    assert np.array_equal(read_matrix(MatrixFile(path)).toarray(), expected)


def test_zeros_in_the_other_triangle_are_no_entries_of_it(tmp_path: Path) -> None:
    path = tmp_path / "mass.mtx"
    lines = [f"{i + 1} {j + 1} {float(np.tril(A)[i, j])!r}" for i, j in np.ndindex(3, 3)]
    path.write_text(HEADING + "3 3 9\n" + "\n".join(lines) + "\n", encoding="utf-8")
    assert np.array_equal(read_matrix(MatrixFile(path)).toarray(), A)
