"""Harwell-Boeing files as Ansys writes them, and rows in the order of its equations."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fe_bodies import bracket, ends, load_body, write_arm
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import io, sparse

from flexarm_model.bodies.body_reduction import reduce_body
from flexarm_model.fe_import.fe_model import load_model
from flexarm_model.fe_import.harwell_boeing import write_harwell_boeing
from flexarm_model.fe_import.hexahedra import write_solid
from flexarm_model.fe_import.matrix_file import read_matrix
from flexarm_model.fe_import.row_order import DISPLACEMENTS, read_rows
from flexarm_model.manipulator.imported_body import MatrixFile
from flexarm_model.reading.config import load_config
from flexarm_model.settings.strict_yaml import ConfigError

Array = NDArray[np.float64]
A = np.array([[4.0, -1.0, 0.0], [-1.0, 5.0, 0.125], [0.0, 0.125, 6.0]])
SOLID = bracket()


def read(path: Path, content: str | None = None) -> Array:
    if content is not None:
        path.write_text(content, encoding="utf-8")
    return np.asarray(read_matrix(MatrixFile(path)).toarray())


def stored(
    A: Array, kind: str = "RSA", repeat: int = 1, real: Callable[[float], str] | None = None, rhs: int = 0
) -> str:
    """Return a file that holds the entries of a matrix, column by column, in Fortran's columns."""
    real = real or (lambda value: f"{value:25.16E}".replace("E", "D"))
    columns = [np.flatnonzero(column) for column in A.T]
    pointers = np.cumsum([1, *(rows.size for rows in columns)])
    numbers = [
        [f"{p:8d}" for p in pointers],
        [f"{i + 1:8d}" for rows in columns for i in rows],
        [real(A[i, j]) for j, rows in enumerate(columns) for i in rows],
    ]
    lines = [["".join(part[k : k + repeat]) for k in range(0, len(part), repeat)] for part in numbers]
    width = len(numbers[2][0])
    header = [
        f"{'Stiffness matrix from an Ansys .full file':72}{'K':8}",
        "".join(f"{n:14d}" for n in (sum(map(len, lines)) + rhs, *map(len, lines), rhs)),
        f"{kind:14}" + "".join(f"{n:14d}" for n in (*A.shape, len(numbers[1]), 0)),
        f"{f'({repeat}I8)':16}{f'({repeat}I8)':16}{f'({repeat}D{width}.{width - 9})':20}{'(1D25.16)':20}",
    ]
    header += [f"{'F':14}{1:14d}{0:14d}"] if rhs else []
    tail = [f"{0.5:25.16E}"] * rhs
    return "\n".join([*header, *lines[0], *lines[1], *lines[2], *tail, ""])


@pytest.mark.parametrize("repeat", [1, 3])
@pytest.mark.parametrize("rhs", [0, 3])
@pytest.mark.parametrize("triangle", [np.tril, np.triu, np.asarray], ids=["lower", "upper", "both"])
def test_a_symmetric_matrix_may_hold_a_triangle_or_both(
    triangle: Callable[[Array], Array], rhs: int, repeat: int, tmp_path: Path
) -> None:
    assert np.array_equal(read(tmp_path / "k.matrix", stored(triangle(A), "RSA", repeat, rhs=rhs)), A)


def test_numbers_may_touch_each_other(tmp_path: Path) -> None:
    """Fixed columns: a reader that splits at blanks makes one number of three."""
    content = stored(-abs(A), repeat=3, real=lambda value: f"{value:10.3E}".replace("E", "D"))
    assert "-4.000D+00-1.000D+00-1.000D+00" in content
    assert np.array_equal(read(tmp_path / "k.matrix", content), -abs(A))


@pytest.mark.parametrize(
    ("form", "text"),
    [("(3E10.3)", " 0.500E+01"), ("(1P,3E10.3)", " 5.000e+00"), ("(1P3G10.3)", "  5.000000"),
     ("(3D10.3)", " 5.000D+00"), ("(3F10.3)", "     5.000"), ("( 3E10.3E3 )", "5.000E+000")],
)  # fmt: skip
def test_every_way_to_write_a_real_number_is_read(form: str, text: str, tmp_path: Path) -> None:
    content = stored(np.diag([5.0, 5.0]), repeat=3, real=lambda value: text).replace("(3D10.1)", f"{form:8}")
    assert np.array_equal(read(tmp_path / "k.rsa", content), np.diag([5.0, 5.0]))


def test_an_exponent_without_its_letter_is_read(tmp_path: Path) -> None:
    content = stored(np.diag([2.0]), real=lambda value: " 0.200-100")
    assert read(tmp_path / "k.hb", content) == pytest.approx(0.2e-100, rel=1e-15)


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.integers(1, 8), st.floats(0.05, 1.0), st.integers(0, 2**32 - 1))
def test_what_scipy_writes_is_read(tmp_path: Path, n: int, density: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    matrix = sparse.random_array((n, n), density=density, rng=rng) + sparse.eye_array(n)
    io.hb_write(tmp_path / "k.rua", sparse.csc_matrix(matrix + matrix.T))
    assert read(tmp_path / "k.rua") == pytest.approx((matrix + matrix.T).toarray(), rel=1e-7)


GOOD = stored(np.tril(A))
LINES = GOOD.splitlines()  # header, 4 pointers, 5 row numbers, 5 values


@pytest.mark.parametrize(
    ("number", "line", "words"),
    [
        (2, "14 4", "'14 4': expected numbers of lines: in all, pointers, row numbers, values"),
        (3, LINES[2].replace("RSA", "PSA"), "'PSA "),
        (3, LINES[2].replace("RSA", "RSE"), "expected type RSA or RUA: real, assembled, symmetric or not"),
        (3, LINES[2].replace("RSA", "CSA"), "expected type RSA or RUA"),
        (3, "RSA 3 x 5", "'RSA 3 x 5': expected type, rows, columns, entries"),
        (4, "(1I8) (1I8)", "expected formats of pointers, row numbers and values"),
        (4, LINES[3].replace("(1I8)", "(1X8)", 1), "expected a format of I such as (I20) for (1X8)"),
        (4, LINES[3].replace("(1D25.16)", "(1I25)", 1), "expected a format of D, E, F, G such as (D20)"),
        (5, "       2", "pointers: expected to rise from 1 to 6"),
        (6, "       9", "pointers: expected to rise from 1 to 6"),
        (9, "       9", "row 9: expected from 1 to 3"),
        (9, "       0", "row 0: expected from 1 to 3"),
        (9, "     1_0", "'     1_0': expected 1 numbers in (1I8)"),
        (18, "         4.0x", "expected 1 numbers in (1D25.16)"),
    ],
)
def test_a_wrong_line_is_refused_by_its_number(number: int, line: str, words: str, tmp_path: Path) -> None:
    assert len(LINES) == 18
    lines = [*LINES[: number - 1], line, *LINES[number:]]
    number = 5 if "pointers:" in words else number
    with pytest.raises(ConfigError) as caught:
        read(tmp_path / "k.matrix", "\n".join(lines))
    assert str(caught.value).startswith(f"{tmp_path / 'k.matrix'}: line {number}: ")
    assert words in str(caught.value)


FEWER = LINES[1].replace(f"{5:14d}{0:14d}", f"{4:14d}{0:14d}")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("K\n", "has 1 lines; expected a Harwell-Boeing matrix in text"),
        ("\n".join(LINES[:-1]), "has 17 lines; expected 18: it is cut short"),
        (GOOD.replace(LINES[1], FEWER), "line 14: 4 lines of (1D25.16) hold 4 numbers; expected 5"),
        (GOOD.replace(LINES[-1], f"{'NaN':>25}"), "expected real, finite entries"),
    ],
)
def test_a_wrong_file_is_refused_by_name(content: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError) as caught:
        read(tmp_path / "k.matrix", content)
    assert str(caught.value).startswith(f"{tmp_path / 'k.matrix'}: ") and words in str(caught.value)


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.integers(0, len(GOOD) - 1), st.text("0123456789-+.DEI()RSAU_ \nx", max_size=5), st.integers(0, 30))
def test_a_damaged_file_is_read_or_refused_and_nothing_else(
    tmp_path: Path, at: int, put: str, taken: int
) -> None:
    try:
        read(tmp_path / "k.matrix", GOOD[:at] + put + GOOD[at + taken :])
    except ConfigError as error:
        assert str(tmp_path / "k.matrix") in str(error)


def mapping(order: NDArray[np.intp], per_node: int = 3) -> str:
    """Return the file that says what stands in each row; ``order`` is the row of every displacement."""
    lines = [""] * order.size
    for d, row in enumerate(order):
        node, which = divmod(d, per_node)
        lines[row] = f"{row + 1:15d}{node + 1:15d}     {DISPLACEMENTS[which]}"
    return "     Matrix Eqn           Node      DOF\n" + "\n".join(lines) + "\n"


def write_shuffled(folder: Path, seed: int = 3) -> None:
    """Write the solid with its equations in another order, as Ansys would."""
    write_solid(SOLID, folder, ends(SOLID), ".matrix")
    order = np.random.default_rng(seed).permutation(SOLID.K.shape[0])
    back = np.argsort(order)
    for name, matrix in (("mass", SOLID.M), ("stiffness", SOLID.K)):
        write_harwell_boeing(folder / f"{name}.matrix", matrix.tocsr()[back][:, back])
    (folder / "K.mapping").write_text(mapping(order), encoding="utf-8")


def load_shuffled(folder: Path, **body: Any) -> Any:
    path = write_arm(folder, SOLID, ".matrix", **body)
    write_shuffled(folder)
    return load_config(path).bodies["solid"]


def test_matrices_in_the_order_of_the_equations_are_the_same_body(tmp_path: Path) -> None:
    (tmp_path / "plain").mkdir()
    expected = load_body(tmp_path / "plain", SOLID)
    body = load_shuffled(tmp_path, rows="K.mapping")
    model, plain = load_model(body), load_model(expected)
    for name in ("M", "K"):
        gap = abs(getattr(model, name) - getattr(plain, name)).max()
        assert gap <= 1e-15 * abs(getattr(plain, name)).max(), name
    both = {"root", "end"}
    assert reduce_body(body, both).omega == pytest.approx(reduce_body(expected, both).omega, rel=1e-9)


def test_the_order_of_the_rows_belongs_to_the_identity_and_is_asked_for(tmp_path: Path) -> None:
    body = load_shuffled(tmp_path, rows="K.mapping")
    assert load_shuffled(tmp_path).digest != body.digest
    with pytest.raises(ValueError, match="the stiffness resists rigid motion"):
        reduce_body(load_shuffled(tmp_path), {"root", "end"})


@pytest.mark.parametrize("per_node", [3, 6])
def test_rows_are_read_with_and_without_rotations(per_node: int, tmp_path: Path) -> None:
    order = np.random.default_rng(per_node).permutation(4 * per_node)
    (tmp_path / "K.mapping").write_text(mapping(order, per_node), encoding="utf-8")
    assert np.array_equal(read_rows(tmp_path / "K.mapping", np.arange(1, 5)), order)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            "      5              2     UY\n",
            "",
            "node 2 has no UY; expected UX, UY, UZ of every node of a free",
        ),
        ("2     UY", "2     TEMP", "expected a displacement of UX, UY, UZ, ROTX, ROTY, ROTZ"),
        ("2     UY", "2     ROTY", "node 1 has no ROTX; expected UX, UY, UZ, ROTX, ROTY, ROTZ of every node"),
        ("2     UY", "2", "expected row, node label, displacement"),
        ("2     UY", "9     UY", "node 9 is not in the file of nodes, which has 2 labels from 1 to 2"),
        ("2     UY", "2     UX", "UX of node 2 is given twice; give it once"),
        ("      5   ", "      4   ", "row 4 is given twice; give it once"),
        ("      5   ", "      7   ", "rows 1 to 7; expected 1 to 6"),
        ("      5   ", "      0   ", "row 0: expected from 1 to 12, at most"),
        ("      5   ", "    5.5   ", "expected row, node label, displacement"),
    ],
)
def test_wrong_rows_are_refused_by_name(old: str, new: str, words: str, tmp_path: Path) -> None:
    good, path = mapping(np.arange(6)), tmp_path / "K.mapping"
    assert good.count(old) == 1
    path.write_text(good.replace(old, new), encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        read_rows(path, np.array([1, 2]))
    assert str(caught.value).startswith(f"{path}: ") and words in str(caught.value)


def test_rows_that_do_not_fit_the_matrices_are_refused(tmp_path: Path) -> None:
    body = load_shuffled(tmp_path, rows="K.mapping")
    (tmp_path / "stiffness.matrix").write_text(stored(np.eye(6 * SOLID.x.shape[0])), encoding="utf-8")
    n = SOLID.K.shape[0]
    with pytest.raises(ConfigError, match=rf"stiffness.matrix: has {2 * n} rows; expected {n}, as .* lists"):
        load_model(body)


def test_a_missing_file_of_rows_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"bodies\.solid\.rows: 'none.mapping': .*cannot be read"):
        load_shuffled(tmp_path, rows="none.mapping")
