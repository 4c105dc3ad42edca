"""Files of imported bodies: four formats hold the same matrix, and what is wrong is refused by name."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fe_bodies import block, bracket, description, ends, load_body, write_arm
from scipy import io, sparse

from flexarm_model.fe_import.__main__ import main
from flexarm_model.fe_import.fe_model import load_model
from flexarm_model.fe_import.hexahedra import write_solid
from flexarm_model.fe_import.matrix_file import read_matrix
from flexarm_model.fe_import.mesh_files import read_nodes, read_set
from flexarm_model.manipulator.imported_body import ImportedBody, MatrixFile
from flexarm_model.reading.config import load_config
from flexarm_model.settings.strict_yaml import ConfigError

A = np.array([[4.0, -1.0, 0.0], [-1.0, 5.0, 0.1], [0.0, 0.1, 6.0]])
LOWER = np.tril(A)
BANNER = "%%MatrixMarket matrix coordinate real general\n"
SHELL = "label, x, y, z\n1, 0, 0, 0\n2; 1 ;0; 0\n\n# comment\n7\t0 1e0 0\n"


def read(path: Path, content: str | None = None, variable: str = "") -> np.ndarray:
    if content is not None:
        path.write_text(content, encoding="utf-8")
    return np.array(read_matrix(MatrixFile(path, variable)).toarray())


@pytest.mark.parametrize("suffix", [".mtx", ".mat", ".abaqus.mtx", ".matrix"])
def test_every_format_gives_back_what_was_written(suffix: str, tmp_path: Path) -> None:
    solid = bracket()
    write_solid(solid, tmp_path, ends(solid), suffix)
    for name, matrix in (("mass", solid.M), ("stiffness", solid.K)):
        assert (
            abs(read_matrix(MatrixFile(tmp_path / f"{name}{suffix}")) - matrix).max()
            <= 1e-16 * abs(matrix).max()
        )


@pytest.mark.parametrize("separator", [" ", ", ", "\t"])
@pytest.mark.parametrize("full", [True, False])
def test_an_abaqus_matrix_may_hold_one_triangle_or_both(full: bool, separator: str, tmp_path: Path) -> None:
    entries = np.argwhere(A if full else LOWER)
    lines = [separator.join((str(i + 1), str(j + 1), repr(float(A[i, j])))) for i, j in entries]
    assert np.array_equal(read(tmp_path / "k.mtx", "** Abaqus\n" + "\n".join(lines)), A)


def test_a_triangle_in_any_format_is_completed(tmp_path: Path) -> None:
    io.mmwrite(tmp_path / "k.mtx", sparse.coo_array(LOWER), symmetry="general")
    io.savemat(tmp_path / "k.mat", {"K": sparse.csc_matrix(LOWER.T)})
    assert np.array_equal(read(tmp_path / "k.mtx"), A) and np.array_equal(read(tmp_path / "k.mat"), A)


@pytest.mark.parametrize("heading", ["", BANNER + "3 3 9\n"], ids=["Abaqus", "Matrix Market"])
def test_zeros_that_stand_in_the_other_triangle_do_not_make_it_whole(heading: str, tmp_path: Path) -> None:
    """Their number was looked at: such a triangle was called not symmetric."""
    entries = [f"{i + 1} {j + 1} {float(LOWER[i, j])!r}" for i, j in np.ndindex(3, 3)]
    assert np.array_equal(read(tmp_path / "k.mtx", heading + "\n".join(entries)), A)


@pytest.mark.parametrize("banner", [BANNER[1:], BANNER])
def test_a_size_is_no_entry_however_the_banner_begins(banner: str, tmp_path: Path) -> None:
    """A banner with one % made an Abaqus file of it: 3, 3 and the number of entries were added to A."""
    entries = [f"{i + 1} {j + 1} {float(A[i, j])!r}" for i, j in np.argwhere(A)]
    text = f"{banner}3 3 {len(entries)}\n" + "\n".join(entries)
    assert np.array_equal(read(tmp_path / "k.mtx", text), A)


def test_a_mass_without_entries_at_its_end_is_as_large_as_the_stiffness(tmp_path: Path) -> None:
    """Abaqus writes no zeros and no size: a lumped mass ended three rows early and was refused."""
    body = load_body(tmp_path, block(2), suffix=".abaqus.mtx")
    last = load_model(body).K.shape[0]
    path = tmp_path / "mass.abaqus.mtx"
    lines = path.read_text(encoding="utf8").splitlines()
    path.write_text("\n".join(line for line in lines if str(last) not in line.replace(",", " ").split()[:2]))
    found = load_model(body)
    assert found.M.shape == found.K.shape == (last, last)
    assert abs(found.M[[last - 1]]).max() == 0.0 < abs(found.M[[last - 2]]).max()


def test_a_matlab_variable_is_chosen_by_name(tmp_path: Path) -> None:
    io.savemat(tmp_path / "both.mat", {"K": sparse.csc_matrix(A), "M": np.eye(3), "scale": 2.0})
    assert np.array_equal(read(tmp_path / "both.mat", variable="K"), A)
    said = r"both.mat: holds 2 matrices; expected variable: one of its matrices: K, M"
    with pytest.raises(ConfigError, match=said):
        read(tmp_path / "both.mat")
    with pytest.raises(ConfigError, match=r"both.mat: variable 'k': expected one of its matrices: K, M"):
        read(tmp_path / "both.mat", variable="k")


WRONG_MATRICES = [
    ("no file", "k.mtx", None, ("k.mtx", "cannot be read")),
    ("unknown suffix", "k.csv", "1 1 1", ("k.csv", "'.csv'", ".mtx, .mm, .mat")),
    (
        "four columns",
        "k.mtx",
        "1 1 4.0\n2 2 5.0 9\n",
        ("k.mtx", "line 2", "'2 2 5.0 9'", "row, column, value"),
    ),
    ("Abaqus' names of nodes", "k.mtx", "1,1, 1,1, 4.0\n", ("names nodes", "row, column, value")),
    ("not a number", "k.mtx", "** a\n1 1 4.0\n2 2 x\n", ("line 3", "'2 2 x'")),
    ("NaN", "k.mtx", "1 1 4.0\n2 2 nan\n", ("line 2", "nan")),
    ("row zero", "k.mtx", "0 1 4.0\n", ("row 0", "from 1 to 2147483647")),
    ("half a row", "k.mtx", "1.5 1 4.0\n", ("row 1.5", "whole number")),
    ("a row beyond all", "k.mtx", "1e300 1 4.0\n", ("row 1e+300", "from 1 to 2147483647")),
    ("a row beyond memory", "k.mtx", "1000000000000,1,4.0\n1,1,1\n", ("row 1e+12", "from 1 to 2147483647")),
    ("Fortran's exponent in the first row", "k.mtx", "1,1,4.0D0\n2,2,5.0\n", ("line 1", "4.0D0")),
    ("Python's underscore", "k.mtx", "1 1 4_0\n2 2 5.0\n", ("line 1", "'1 1 4_0'")),
    ("no entries", "k.mtx", "** nothing\n", ("holds no rows", "row, column, value")),
    (
        "broken Matrix Market",
        "k.mtx",
        BANNER + "2 2 2\n1 1 1.0\n9 1 1.0\n",
        ("k.mtx", "Matrix Market", "line 4"),
    ),
    ("complex", "k.mtx", BANNER.replace("real", "complex") + "1 1 1\n1 1 1.0 2.0\n", ("real, finite",)),
    ("pattern", "k.mtx", BANNER.replace("real", "pattern") + "1 1 1\n1 1\n", ("pattern", "real entries")),
    ("no banner", "k.mtx", "% my own\n2 2 1\n1 1 1.0\n", ("line 1", "'% my own'", "banner of Matrix Market")),
    ("banner below", "k.mtx", "\n" + BANNER + "2 2 1\n1 1 1.0\n", ("line 1", "banner of Matrix Market")),
    ("Abaqus as .mm", "k.mm", "1,1,4.0\n", ("line 1", "banner of Matrix Market")),
    (
        "dense beyond memory",
        "k.mtx",
        BANNER.replace("coordinate", "array") + "9999999 9999999\n1\n",
        ("k.mtx", "line 2", "has 1 lines of entries; expected 99999980000001"),
    ),
    ("not square", "k.mtx", BANNER + "2 3 1\n1 1 1.0\n", ("2 x 3", "square")),
    ("not MATLAB", "k.mat", "hello", ("k.mat", "no MATLAB file of version 4 to 7.2")),
]


@pytest.mark.parametrize("case", WRONG_MATRICES, ids=[case[0] for case in WRONG_MATRICES])
def test_a_wrong_matrix_is_refused_by_name(
    case: tuple[str, str, str | None, tuple[str, ...]], tmp_path: Path
) -> None:
    _, name, content, expected = case
    with pytest.raises(ConfigError) as caught:
        read(tmp_path / name, content)
    for fragment in expected:
        assert fragment in str(caught.value)


@pytest.mark.parametrize("format_", [sparse.csc_matrix, np.asarray], ids=["sparse", "full"])
def test_a_logical_matlab_matrix_is_refused_and_not_read_as_ones(format_: Any, tmp_path: Path) -> None:
    """``spones(K) > 0`` beside K, or ``K ~= 0``, is where K has entries; SciPy makes ones of it."""
    K = np.array([[2.0, 1.0], [1.0, 3.0]])
    path = tmp_path / "k.mat"
    io.savemat(path, {"pattern": format_(K != 0.0), "K": format_(K)})
    assert np.array_equal(read_matrix(MatrixFile(path, "K")).toarray(), K)
    with pytest.raises(
        ConfigError, match=f"{path}: variable 'pattern': is logical, .* expected real entries"
    ):
        read_matrix(MatrixFile(path, "pattern"))


def test_a_variable_is_for_matlab_only(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="variable 'K': only a .mat file"):
        read(tmp_path / "k.mtx", "1 1 4.0\n", variable="K")


def test_nodes_are_read_in_their_order_with_any_separator(tmp_path: Path) -> None:
    path = tmp_path / "nodes.csv"
    path.write_text(SHELL, encoding="utf-8")
    labels, x = read_nodes(path)
    assert labels.tolist() == [1, 2, 7] and x.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


def test_a_set_names_rows_and_weights(tmp_path: Path) -> None:
    path = tmp_path / "set.txt"
    path.write_text("7 2.5\n1 0.5\n", encoding="utf-8")
    index, weight = read_set(path, np.array([1, 2, 7]))
    assert index.tolist() == [2, 0] and weight.tolist() == [2.5, 0.5]


@pytest.mark.parametrize("lines", ["6, 7\n8, 9\n", "6, 7\n", "2, 1\n4, 3\n"])
def test_two_labels_on_a_line_are_not_a_label_and_its_weight(lines: str, tmp_path: Path) -> None:
    """Half of the nodes were left out without a word, and the others weighed by their neighbours' labels."""
    path = tmp_path / "set.txt"
    path.write_text(lines, encoding="utf-8")
    with pytest.raises(ConfigError, match=r"set\.txt: .* labels of nodes too.* one node label per line"):
        read_set(path, np.arange(1, 10))


@pytest.mark.parametrize(
    "lines", ["6, 1\n", "6, 1\n7, 1\n", "6, 3\n7, 3\n", "6, 7\n7, 8\n", "6, 20\n", "6, 7.5\n"]
)
def test_weights_that_cannot_be_labels_are_weights(lines: str, tmp_path: Path) -> None:
    path = tmp_path / "set.txt"
    path.write_text(lines, encoding="utf-8")
    index, weight = read_set(path, np.arange(1, 10))
    rows = [line.split(", ") for line in lines.split("\n")[:-1]]
    assert index.tolist() == [int(row[0]) - 1 for row in rows]
    assert weight.tolist() == [float(row[1]) for row in rows]


@pytest.mark.parametrize("heading", ["", "label, weight\n", "nodes of the flange\n"])
def test_no_row_is_lost_to_a_mark_or_a_heading(heading: str, tmp_path: Path) -> None:
    """Excel's "CSV UTF-8" begins with U+FEFF: the first row was taken for headings."""
    path = tmp_path / "set.txt"
    path.write_text(f"{heading}7, 2.5\n1, 0.5\n", encoding="utf-8-sig")
    assert read_set(path, np.array([1, 2, 7]))[0].tolist() == [2, 0]


def test_no_entry_of_a_matrix_is_lost_to_a_mark(tmp_path: Path) -> None:
    assert np.array_equal(read(tmp_path / "k.mtx", "\ufeff1,1,2.0\n2,2,3.0\n2,1,1.0\n"), [[2, 1], [1, 3]])


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ("1\n5\n", ("node label 5", "3 labels from 1 to 7")),
        ("1\n2\n1\n", ("node label 1", "given twice")),
        ("1 0\n", ("node label 1", "weight 0 must be above 0")),
        ("1 1 1\n", ("line 1", "node label and weight")),
        ("1O\n1\n2\n", ("line 1", "'1O'", "node label")),
        ("7 bolt A\n1\n2\n", ("line 1", "'7 bolt A'")),
        ("bolt 7\n1\n", ("line 1", "'bolt 7'")),
        ("nan\n1\n", ("line 1", "'nan'")),
        ("-.5x\n1\n", ("line 1", "'-.5x'")),
        ("1e300\n", ("node label 1e+300", "whole number from 1")),
        ("", ("holds no rows",)),
    ],
)
def test_a_wrong_set_is_refused_by_name(content: str, expected: tuple[str, ...], tmp_path: Path) -> None:
    path = tmp_path / "set.txt"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        read_set(path, np.array([1, 2, 7]))
    for fragment in (str(path), *expected):
        assert fragment in str(caught.value)


WRONG_BODIES: list[tuple[str, dict[str, Any], tuple[str, ...]]] = [
    ("no unit", {"units": {"length": "m"}}, ("bodies.solid.units.mass", "must be given")),
    ("unknown unit", {"units": {"length": "in", "mass": "kg"}}, ("units.length", "'in'", "m, mm, um")),
    (
        "unknown kind",
        {"interfaces": {"root": {"set": "root.txt", "kind": "RBE2"}}},
        ("kind", "rigid, averaging"),
    ),
    (
        "no root",
        {"interfaces": {"end": {"set": "end.txt", "kind": "rigid"}}},
        ("interfaces", "must hold 'root'"),
    ),
    (
        "both bounds",
        {"reduction": {"method": "craig_bampton", "modes": 3, "f_max": "1 kHz"}},
        ("either modes",),
    ),
    ("no bound", {"reduction": {"method": "craig_bampton"}}, ("reduction.modes", "either modes or f_max")),
    (
        "Guyan up to f_max",
        {"reduction": {"method": "guyan", "f_max": "1 kHz"}},
        ("reduction.f_max", "static"),
    ),
    ("no such file", {"mass": {"file": "m.mtx"}}, ("bodies.solid", "m.mtx", "cannot be read")),
    ("no such nodes", {"nodes": "points.csv"}, ("bodies.solid.nodes", "points.csv", "cannot be read")),
    ("unknown key", {"density": 1}, ("bodies.solid.density", "unknown key", "interfaces")),
    ("number as file", {"nodes": 5}, ("bodies.solid.nodes", "5", "a text")),
]


@pytest.mark.parametrize("case", WRONG_BODIES, ids=[case[0] for case in WRONG_BODIES])
def test_a_wrong_description_is_refused_by_name(
    case: tuple[str, dict[str, Any], tuple[str, ...]], tmp_path: Path
) -> None:
    path = write_arm(tmp_path, block(2), **case[1])
    with pytest.raises(ConfigError) as caught:
        load_config(path)
    for fragment in (str(path), *case[2]):
        assert fragment in str(caught.value)


def test_matrices_that_do_not_fit_the_nodes_are_refused(tmp_path: Path) -> None:
    body = load_body(tmp_path, block(2))
    io.mmwrite(tmp_path / "stiffness.mtx", sparse.eye_array(5))
    with pytest.raises(ConfigError, match=r"stiffness.mtx: has 5 rows; expected 81 or 162 .* 27 nodes"):
        load_model(body)
    io.mmwrite(tmp_path / "stiffness.mtx", sparse.eye_array(162))
    with pytest.raises(ConfigError, match=r"mass.mtx: has 81 rows; expected 162 as the stiffness"):
        load_model(body)


def test_the_identity_follows_the_content_of_the_files(tmp_path: Path) -> None:
    path = write_arm(tmp_path, block(2))
    before = load_config(path).config_id
    assert load_config(path).config_id == before
    lines = (tmp_path / "stiffness.mtx").read_text(encoding="utf-8")
    (tmp_path / "stiffness.mtx").write_text(lines + "\n", encoding="utf-8")
    assert load_config(path).config_id != before


def test_positions_of_interface_nodes_are_part_of_the_description(tmp_path: Path) -> None:
    interfaces = {
        "root": {"set": "root.txt", "kind": "rigid", "at": ["10 mm", "0 mm", "0 mm"]},
        "end": {"set": "end.txt", "kind": "rigid"},
    }
    body = load_body(tmp_path, block(2), interfaces=interfaces, orientation=["0 deg", "0 deg", "90 deg"])
    assert isinstance(body, ImportedBody) and np.array_equal(body.nodes["root"], np.zeros(3))
    assert body.nodes["end"] == pytest.approx([0, 0.39, 0], abs=1e-15)
    assert description()["bodies"]["solid"]["interfaces"]["end"]["kind"] == "averaging"


@pytest.mark.parametrize(("at", "fits"), [("0.5 m", True), ("0.9 m", False), ("100 m", False)])
def test_an_interface_far_from_its_own_nodes_is_refused(tmp_path: Path, at: str, fits: bool) -> None:
    interfaces = {
        "root": {"set": "root.txt", "kind": "rigid"},
        "end": {"set": "end.txt", "kind": "averaging", "at": [at, "0 mm", "0 mm"]},
    }
    path = write_arm(tmp_path, block(2), interfaces=interfaces)
    if fits:
        load_config(path)
        return
    with pytest.raises(ConfigError) as caught:
        load_config(path)
    assert f"{path}: bodies.solid.interfaces.end.at: ['{at}', '0 mm', '0 mm']: lies " in str(caught.value)
    assert "m from the middle of its nodes, farther than the body is large (0.401 m)" in str(caught.value)


def test_the_figures_of_a_body_are_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = str(write_arm(tmp_path, bracket()))
    assert main([path, "solid"]) == 0 and "rigid modes                      6" in capsys.readouterr().out
    assert main([path, "payload"]) == 2 and "an imported one: solid" in capsys.readouterr().err
    assert main([path]) == 2 and "usage" in capsys.readouterr().err
