"""What a file of standard input data says of a body must be possible, and none of it may be lost."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from test_sid_damping import older
from test_sid_file import beam, rigid

from flexarm_model.bodies.sid_file import read_sid, write_sid
from flexarm_model.bodies.sid_taylor import Taylor, read_taylor
from flexarm_model.bodies.sid_text import parse_blocks
from flexarm_model.settings.strict_yaml import ConfigError


@pytest.fixture
def text(tmp_path: Path) -> str:
    write_sid(beam(), tmp_path / "whole.sid")
    return (tmp_path / "whole.sid").read_text(encoding="utf-8")


def refusal(path: Path, content: str) -> str:
    path.write_text(content, encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        read_sid(path)
    assert str(caught.value).startswith(f"{path}: line ")
    return str(caught.value)


def test_no_line_of_the_file_can_be_lost_or_changed(text: str, tmp_path: Path) -> None:
    """Lines of the block of our own were not looked at: without omega(1) the slowest mode had none."""
    lines = text.splitlines()
    begin = lines.index("flexarm")
    chosen = np.random.default_rng(0).choice(np.arange(begin + 1, len(lines) - 1), 15, replace=False)
    for k in chosen:
        refusal(tmp_path / "q.sid", "\n".join([*lines[:k], *lines[k + 1 :]]))
        refusal(tmp_path / "q.sid", "\n".join([*lines[:k], lines[k] + "1", *lines[k + 1 :]]))
    for key in ("omega( 1)", "damping_ratio", "P("):
        assert any(line.startswith(key) for line in lines[begin:])
        left = [line for k, line in enumerate(lines) if k < begin or not line.startswith(key)]
        assert "the file was changed" in refusal(tmp_path / "q.sid", "\n".join(left))


@pytest.mark.parametrize("version", [1, 2])
@pytest.mark.parametrize(
    ("pattern", "new", "expected"),
    [
        (r"\nomega\( 1\) = .*", "", "omega"),
        (r"\nomega\( 1\) = .*", "\nomega( 1) = 1.0", "omega"),
        (r"\nomega\( 1\) = .*", "\nomega( 1) = nan", "'nan' is not a finite number"),
        (r"\nP\( 1,  1,.*", "", "matrix J"),
        (r"\nP\( 1, (?!\s*1,).*", "", "does not stand for the matrix"),
        (r"\nname = .*", "", "'name = <text>' is missing"),
        (r"\nfields = .*", "\nfields = 2", "fields = 2: expected a whole number"),
        (r"\nfields = .*", "\nfields = -1", "fields = -1: expected a whole number"),
        (r"\nfields = .*", "\nfields = nan", "'nan' is not a finite number"),
    ],
)
def test_a_block_of_an_older_version_stands_for_the_matrices_before_it(
    version: int, pattern: str, new: str, expected: str, text: str, tmp_path: Path
) -> None:
    whole = older(text, version)
    changed = re.sub(pattern, new, whole)
    assert changed != whole
    assert expected in refusal(tmp_path / "q.sid", changed)


@pytest.mark.parametrize("ratio", ["-3", "nan", "1.5"])
def test_a_ratio_of_an_older_version_is_one(ratio: str, text: str, tmp_path: Path) -> None:
    changed = older(text, 2).replace("damping_ratio = 0.01", f"damping_ratio = {ratio}")
    assert "flexarm: " in refusal(tmp_path / "q.sid", changed)


def test_older_versions_that_are_whole_are_read(text: str, tmp_path: Path) -> None:
    for version in (1, 2):
        (tmp_path / "q.sid").write_text(older(text, version), encoding="utf-8")
        assert np.array_equal(read_sid(tmp_path / "q.sid").P, beam().P)


WRONG = [
    (r"mass = .*", "mass = nan", ("refmod", "'nan' is not a finite number")),
    (r"mass = .*", "mass = -5", ("refmod", "mass = -5: must not be negative")),
    (r"nelastq = .*", "nelastq = nan", ("refmod", "not a finite number")),
    (r"nelastq = .*", "nelastq = -1", ("refmod", "from 0 to 1000")),
    (r"nelastq = .*", "nelastq = 1e12", ("refmod", "from 0 to 1000")),
    (r"nelastq = .*", "nelastq = 2.5", ("refmod", "from 0 to 1000")),
    (r"nrow = .*", "nrow = 1e12", ("origin", "is 1e+12 x 1; expected 3 x 1")),
    (r"nrow = .*", "nrow = -2", ("origin", "is -2 x 1; expected 3 x 1")),
    (r"order = .*", "order = 2", ("origin", "order = 2: expected a whole number from 0 to 1")),
    (r"structure = .*", "structure = 2", ("origin", "is 3 x 1, not symmetric")),
    (r"structure = .*", "structure = 4", ("origin", "structure = 4: expected a whole number from 0 to 3")),
    (r"m0\( 1,  1\)", "m0( , 1)", ("', 1'", "whole numbers between commas")),
    (r"m0\( 1,  1\)", "m0( 1 1)", ("'1 1'", "whole numbers between commas")),
    (r"m0\( 1,  1\) = .*", "m0( 1, 1) = inf", ("'inf' is not a finite number",)),
    (r"(\nKe\n[^m]*)m0\( 1,  1\) = .*", r"\1m0( 1, 1) = -9e5", ("Ke: must have no negative eigenvalue",)),
    (r"(\nKe\n[^m]*)m0\( 1,  1\) = .*", r"\1m0( 1, 1) = nan", ("Ke: 'nan'",)),
    (r"(\nDe\n[^m]*)m0\( 1,  1\) = .*", r"\1m0( 1, 1) = -1", ("De: must have no negative eigenvalue",)),
    (r"(\nMe\n[^m]*)m0\( 1,  1\) = .*", r"\1m0( 1, 1) = -1", ("Me: must have no negative eigenvalue",)),
    (r"(\nMe\n[^m]*)m0\( 1,  1\) = .*", r"\1m0( 1, 2) = 0.7", ("Me: must be symmetric",)),
    (r"(\nJ\n(?:.*\n)*?) *m0\( 2,  2\) = .*", r"\1m0( 2, 2) = -7", ("J: must have no negative eigenvalue",)),
    (r"(\npsi\n(?:.*\n)*?) *ncol = .*", r"\1ncol = 2", ("psi: is 3 x 2; expected 3 x 6",)),
    (r"(\nKe\n[^m]*)(m0\( 1,  1\) = .*)", r"\1\2\nm0(1,1) = 5", ("Ke: m0(1, 1) is given twice",)),
    (r"(\nKe\n[^m]*)m0\( 1,  1\)", r"\1M0(1, 1)", ("Ke: M0(1, 1): with order = 0 expected m0",)),
    (r"(\nKe\n[^s]*)structure = 3", r"\1structure = 0", ("Ke: m0(1, 1) has no place with structure = 0",)),
    (r"(\nKe\n[^n]*)nrow = 6", r"\1nrow = 6\nnrow = 6", ("Ke: 'nrow' is given twice",)),
    (r"(\nCt\n(?:.*\n)*?) *nq = .*", r"\1nq = 7", ("Ct: nq = 7: expected a whole number from 6 to 6",)),
    (r"(\nCt\n *)order = 1", r"\1order = 0", ("Ct: m1", "with order = 0 expected m0")),
    (r"\nnew node = end\n", "\nnew node\n", ("node: has no name",)),
    (r"\nnew node = end\n", "\nnew node = root\n", ("node: is given twice, root",)),
]


@pytest.mark.parametrize(("pattern", "new", "expected"), WRONG)
def test_what_cannot_be_a_body_is_refused_by_file_and_line(
    pattern: str, new: str, expected: tuple[str, ...], text: str, tmp_path: Path
) -> None:
    part = text.partition("\nflexarm\n")[0] + "\n"
    changed = re.sub(pattern, new, part, count=1)
    assert changed != part
    told = refusal(tmp_path / "q.sid", changed)
    for fragment in expected:
        assert fragment in told


def test_a_coordinate_without_mass_is_refused(text: str, tmp_path: Path) -> None:
    before, rest = text.partition("\nflexarm\n")[0].split("\nMe\n")
    matrix, after = rest.split("\nend Me\n")
    empty = re.sub(r" *m0.*\n?", "", matrix + "\n")
    told = refusal(tmp_path / "q.sid", f"{before}\nMe\n{empty}\nend Me\n{after}\n")
    assert "Me: must be positive definite: a coordinate has no mass" in told


def test_a_rigid_body_passes_every_check(tmp_path: Path) -> None:
    write_sid(rigid(), tmp_path / "q.sid")
    assert read_sid(tmp_path / "q.sid").n == 0


SQUARE = "Ke\norder = 0\nnrow = 3\nncol = 3\nnq = 3\nnqn = 0\nstructure = 2\n{}\nend Ke"


def square(*entries: str) -> Taylor:
    lines = SQUARE.format("\n".join(entries)).splitlines()
    return read_taylor(parse_blocks(Path("q.sid"), lines).block("Ke"), 3, (3, 3))


def test_what_is_given_on_either_side_of_the_diagonal_holds_on_both() -> None:
    """With one entry above the diagonal all below it were lost."""
    full = square("m0(1,1) = 5", "m0(2,2) = 5", "m0(3,3) = 5", "m0(1,2) = -1", "m0(3,2) = -2").m0
    np.testing.assert_array_equal(full, [[5, -1, 0], [-1, 5, -2], [0, -2, 5]])


def test_entries_that_should_be_equal_and_are_not_are_refused_by_name() -> None:
    square("m0(1,2) = -1", "m0(2,1) = -1")
    with pytest.raises(ConfigError, match=r"Ke.*m0\(1, 2\) = -1 is not symmetric: mirrored it is -3"):
        square("m0(1,2) = -1", "m0(2,1) = -3")


def test_constant_matrices_may_say_that_they_depend_on_nothing(text: str, tmp_path: Path) -> None:
    """Other programs write nq = 0 there."""
    part = text.partition("\nflexarm\n")[0] + "\n"
    changed = re.sub(r"(\nKe\n(?:.*\n)*?) *nq = .*", r"\1nq = 0", part, count=1)
    assert changed != part
    (tmp_path / "q.sid").write_text(changed, encoding="utf-8")
    assert read_sid(tmp_path / "q.sid").n == 6
