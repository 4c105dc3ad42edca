"""Files of standard input data that say a thing twice, and differently."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from test_sid_checks import refusal
from test_sid_file import beam
from test_sid_mass import part_of, six_digits

from flexarm_model.bodies.sid_file import read_sid


def block(part: str, name: str) -> tuple[int, int]:
    """Return where the last block of a name begins and ends in a file."""
    begin = part.rindex(f"\n{name}\n") + 1
    return begin, part.index(f"\nend {name}\n", begin)


def changed(part: str, name: str, entries: str, factor: float) -> str:
    """Return a file with some entries of a block times a factor."""
    begin, end = block(part, name)
    inner = re.sub(rf"({entries}\(.*\) = )(.*)", lambda m: f"{m[1]}{float(m[2]) * factor!r}", part[begin:end])
    assert inner != part[begin:end]
    return part[:begin] + inner + part[end:]


TWICE = [
    ("mdCM", "m1", r"mdCM: m1\(\d, 1, \d\) = .*, but Ct.m0 makes it"),
    ("Oe", "m0", r"Oe: m0\(\d, \d\) = .*, but J.m1 makes it"),
    ("J", "m1", r"Oe: m0\(\d, \d\) = .*, but J.m1 makes it"),
    ("Gr", "m0", r"Gr: m0\(\d, \d+\) = .*, but J.m1 and Cr.m0 makes it"),
    ("origin", "m1", r"origin: m1\(\d, 1, \d\) = .*, but phi.m0 of node 'end' makes it"),
    ("AP", "m1", r"AP: m1\(\d, \d, \d\) = .*, but psi.m0 of node 'end' makes it"),
]


@pytest.mark.parametrize("factor", [-1.0, 1.0001])
@pytest.mark.parametrize(
    ("name", "entries", "expected"), TWICE, ids=[f"{case[0]}.{case[1]}" for case in TWICE]
)
def test_what_stands_twice_and_differs_is_refused_by_name(
    name: str, entries: str, expected: str, factor: float, tmp_path: Path
) -> None:
    """One of the two was taken without a word: a node moved the other way, or by half as much."""
    path = tmp_path / "q.sid"
    told = refusal(path, changed(part_of(beam(), path), name, entries, factor))
    assert re.search(expected, told) and str(path) in told


@pytest.mark.parametrize("name", ["mdCM", "J", "origin", "AP"])
def test_what_a_file_leaves_out_is_taken_from_where_it_stands(name: str, tmp_path: Path) -> None:
    path = tmp_path / "q.sid"
    part = part_of(beam(), path)
    begin, end = block(part, name)
    inner = re.sub(r"  m1\(.*\n", "", part[begin : end + 1]).replace("order = 1", "order = 0")
    path.write_text(part[:begin] + inner + part[end + 1 :], encoding="utf-8")
    assert read_sid(path).omega == pytest.approx(beam().omega, rel=1e-6)


def test_six_digits_are_the_same_twice(tmp_path: Path) -> None:
    path = tmp_path / "q.sid"
    path.write_text(six_digits(part_of(beam(), path)), encoding="utf-8")
    assert read_sid(path).n == beam().n
