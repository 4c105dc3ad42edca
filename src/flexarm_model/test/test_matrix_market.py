"""Matrix Market files: a value is read whole or refused by its line, and nothing ends the process."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import io, sparse

from flexarm_model.fe_import.matrix_file import read_matrix
from flexarm_model.manipulator.imported_body import MatrixFile
from flexarm_model.settings.strict_yaml import ConfigError

A = np.array([[1e5, -2.5, 0.0], [-2.5, 5.0, 0.125], [0.0, 0.125, 6e-7]])
LOWER = [(1, 1, "1.0D+05"), (2, 1, "-2.5d0"), (2, 2, "5"), (3, 2, ".125"), (3, 3, "6.E-7")]
HEAD = "%%MatrixMarket matrix coordinate real general\n"
INTEGERS = HEAD.replace("real", "integer")
ARRAY = "%%MatrixMarket matrix array real general\n2 2\n"


def read(path: Path, content: str) -> NDArray[np.float64]:
    path.write_bytes(content.encode())
    return np.asarray(read_matrix(MatrixFile(path)).toarray())


def coordinate(kind: str = "real", symmetry: str = "symmetric") -> str:
    """Return A in Fortran's numbers: its triangle under symmetric, all of it under general."""
    entries = [*LOWER, *((j, i, value) for i, j, value in LOWER if i != j and symmetry == "general")]
    lines = [
        f"%%MatrixMarket matrix coordinate {kind} {symmetry}",
        "% of a program",
        "",
        f"3 3 {len(entries)}",
    ]
    return "\n".join([*lines, *(f" {i}\t{j} {value}" for i, j, value in entries)]) + "\n"


@pytest.mark.parametrize("end", ["\n", "", "\n\n", "\r\n"], ids=["newline", "none", "two", "Windows"])
@pytest.mark.parametrize("symmetry", ["general", "symmetric"])
def test_fortrans_exponents_are_read_however_the_file_ends(symmetry: str, end: str, tmp_path: Path) -> None:
    """1.0D+05 was read as 1.0 without a word, and without a last newline the process ended (signal 11)."""
    text = coordinate(symmetry=symmetry).rstrip("\n") + end
    text = text.replace("\n", "\r\n") if end == "\r\n" else text
    assert np.array_equal(read(tmp_path / "k.mtx", text), A)


@pytest.mark.parametrize("symmetry", ["general", "symmetric"])
@pytest.mark.parametrize("kind", ["real", "double", "integer"])
def test_arrays_stand_column_by_column(symmetry: str, kind: str, tmp_path: Path) -> None:
    full = np.array([[4.0, -1.0, 0.0], [-1.0, 5.0, 1.0], [0.0, 1.0, 6.0]])
    rows, columns = np.triu_indices(3) if symmetry == "symmetric" else np.indices((3, 3)).reshape(2, -1)
    text = "" if kind == "integer" else "D0"
    values = "\n".join(f"{value:.0f}{text}" for value in full[columns, rows])
    head = f"%%MatrixMarket matrix array {kind} {symmetry}\n3 3\n"
    assert np.array_equal(read(tmp_path / "k.mtx", head + values), full)


@pytest.mark.parametrize("symmetry", ["general", "symmetric"])
@pytest.mark.parametrize("form", ["coordinate", "array"])
@pytest.mark.parametrize("kind", [float, int])
def test_what_scipy_writes_is_read_to_the_last_digit(
    kind: type, form: str, symmetry: str, tmp_path: Path
) -> None:
    rng = np.random.default_rng(4)
    full = rng.integers(-9, 9, (7, 7)) if kind is int else rng.standard_normal((7, 7)) * 1e-7
    full = full + full.T
    path = tmp_path / "k.mtx"
    io.mmwrite(path, sparse.coo_array(full) if form == "coordinate" else full, symmetry=symmetry)
    assert np.array_equal(read_matrix(MatrixFile(path)).toarray(), full)


WRONG = [
    ("decimal comma", HEAD + "2 2 2\n1 1 1,5\n2 2 2.5\n", ("line 3", "'1 1 1,5'", "1.5D3")),
    ("no exponent's letter", HEAD + "2 2 2\n1 1 1.0\n2 2 1.0+05\n", ("line 4", "'2 2 1.0+05'", "1.5D3")),
    ("commas between", HEAD + "2 2 2\n1,1,1.0\n2,2,2.0\n", ("line 3", "'1,1,1.0'", "row and column")),
    ("no value", HEAD + "2 2 2\n1 1\n2 2 2.0\n", ("line 3", "'1 1'")),
    ("a value for two", HEAD + "1 1 1\n1 1 1.0 2.0\n", ("line 3", "'1 1 1.0 2.0'")),
    ("Fortran's stars", HEAD + "% a\n\n1 1 1\n1 1 *****\n", ("line 5", "'1 1 *****'")),
    ("infinite", HEAD + "1 1 1\n1 1 1e999\n", ("line 3", "'1 1 1e999'")),
    ("row zero", HEAD + "2 2 2\n1 1 1.0\n0 1 1.0\n", ("line 4", "'0 1 1.0'", "2 x 2")),
    ("half a column", HEAD + "2 2 2\n1 1 1.0\n1 1.5 1.0\n", ("line 4", "'1 1.5 1.0'")),
    ("too few", HEAD + "2 2 3\n1 1 1.0\n2 2 1.0\n", ("line 2", "has 2 lines of entries; expected 3")),
    ("too many", HEAD + "2 2 1\n1 1 1.0\n2 2 1.0\n", ("line 2", "has 2 lines of entries; expected 1")),
    ("none", HEAD + "2 2 1\n", ("line 2", "has 0 lines of entries; expected 1")),
    ("no size", HEAD, ("line 2", "rows, columns, entries")),
    ("half a size", HEAD + "% a\n2 2\n", ("line 3", "'2 2'", "rows, columns, entries")),
    ("a size beyond all", HEAD + "9999999999 9999999999 1\n1 1 1\n", ("line 2", "up to 2147483647")),
    ("array with a comma", ARRAY + "1\n1,5\n2\n3\n", ("line 4", "'1,5'", "expected a number such as 1.5")),
    ("array of rows", ARRAY + "1 2\n3 4\n", ("line 3", "'1 2'", "expected a number such as 1.5")),
    ("array cut short", ARRAY + "1\n2\n3\n", ("line 2", "has 3 lines of entries; expected 4")),
    (
        "integer",
        INTEGERS + "1 1 1\n1 1 1.5\n",
        ("line 3", "'1 1 1.5'", "a whole number"),
    ),
    ("complex", HEAD.replace("real", "complex") + "1 1 1\n1 1 1 2\n", ("line 1", "complex", "real, finite")),
    ("pattern", HEAD.replace("real", "pattern") + "1 1 1\n1 1\n", ("line 1", "pattern", "real entries")),
    ("another symmetry", coordinate(symmetry="skew-symmetric"), ("line 1", "skew-symmetric", "or symmetric")),
    ("another kind", coordinate("quaternion"), ("line 1", "quaternion", "real or double")),
    ("half a banner", HEAD.replace(" general", "") + "1 1 1\n1 1 1\n", ("line 1", "or symmetric")),
    ("a wide triangle", HEAD.replace("general", "symmetric") + "1 2 1\n1 1 1\n", ("line 2", "square")),
]


@pytest.mark.parametrize("case", WRONG, ids=[case[0] for case in WRONG])
def test_what_is_no_entry_is_refused_by_its_line(
    case: tuple[str, str, tuple[str, ...]], tmp_path: Path
) -> None:
    path = tmp_path / "k.mtx"
    with pytest.raises(ConfigError) as caught:
        read(path, case[1])
    for fragment in (str(path), *case[2]):
        assert fragment in str(caught.value)


def test_the_wrong_line_of_a_long_file_is_named(tmp_path: Path) -> None:
    """Lines are looked at by the thousand; seconds where each by itself took half a minute a million."""
    entries = [f"{k} {k} 1.5" for k in range(1, 3001)]
    entries[2345] += ",0"
    with pytest.raises(ConfigError, match=r"line 2348: '2346 2346 1\.5,0'"):
        read(tmp_path / "k.mtx", HEAD + "3000 3000 3000\n" + "\n".join(entries))
