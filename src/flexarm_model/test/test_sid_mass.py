"""A file of standard input data whose blocks are not of one body is refused; one of little mass is read."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from fe_bodies import bracket, load_body
from test_sid_checks import refusal
from test_sid_file import beam, rigid

from flexarm_model.bodies.body_reduction import reduce_body
from flexarm_model.bodies.sid_file import read_sid, write_sid
from flexarm_model.bodies.superelement import Superelement
from flexarm_model.manipulator.body_spec import RigidBody


def part_of(body: Superelement, path: Path) -> str:
    """Return the file of a body without flexarm's own block."""
    write_sid(body, path)
    return path.read_text(encoding="utf-8").partition("\nflexarm\n")[0] + "\n"


def scaled(part: str, name: str, factor: float) -> str:
    """Return the file with the entries at rest of one block times a factor."""
    begin = part.index(f"\n{name}\n")
    end = part.index(f"\nend {name}\n", begin)
    block = re.sub(r"(m0\(.*\) = )(.*)", lambda m: f"{m[1]}{float(m[2]) * factor!r}", part[begin:end])
    return part[:begin] + block + part[end:]


def six_digits(part: str) -> str:
    """Return the file as a program prints it that knows six digits."""
    return re.sub(r"(m[01]\(.*\)|mass) = (.*)", lambda m: f"{m[1]} = {float(m[2]):.5e}", part)


@pytest.mark.parametrize(
    ("name", "factor", "expected"),
    [
        ("mdCM", 1.5, "mdCM: with mass and J"),
        ("mdCM", 10.0, "mdCM: with mass and J"),
        ("J", 0.1, "mdCM: with mass and J"),
        ("Cr", 3.0, "Cr: with J and Me"),
        ("Ct", 10.0, "Ct: with mass and Me"),
        ("Ct", 1.3, "Ct: with mass and Me"),
        ("Cr", -1.0, "mdCM: with mass, J, Ct, Cr and Me"),
    ],
)
def test_blocks_that_are_not_of_one_body_are_refused_by_name(
    name: str, factor: float, expected: str, tmp_path: Path
) -> None:
    """They were read; an error told of another body later, or the arm was served with wrong numbers."""
    told = refusal(tmp_path / "q.sid", scaled(part_of(beam(), tmp_path / "q.sid"), name, factor))
    assert f"{expected} it gives some motion a negative kinetic energy" in told


def test_bodies_of_every_kind_are_read_with_six_digits(tmp_path: Path) -> None:
    path = tmp_path / "q.sid"
    imported = reduce_body(load_body(tmp_path, bracket()), {"root", "end"})
    for body in (rigid(), beam(), imported):
        path.write_text(six_digits(part_of(body, path)), encoding="utf-8")
        assert read_sid(path).mass == pytest.approx(body.mass, rel=1e-5)


@pytest.mark.parametrize(
    ("mass", "com", "inertia"),
    [
        (0.0, [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
        (0.0, [0.0, 0.0, 0.0], [0.0, 0.0, 2e-3]),
        (1.7, [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
        (1.7, [0.1, -0.2, 0.3], [0.0, 0.0, 0.0]),
        (1.7, [0.3, 0.0, 0.0], [0.0, 0.05, 0.05]),
        (3e-9, [1e-3, 2e-3, 0.0], [0.0, 0.0, 0.0]),
    ],
)
def test_bodies_without_mass_or_inertia_about_an_axis_are_read(
    mass: float, com: list[float], inertia: list[float], tmp_path: Path
) -> None:
    """A frame, a flywheel, a mass in the origin and off it, a rod, a grain."""
    path, root = tmp_path / "q.sid", {"root": np.zeros(3)}
    body = reduce_body(RigidBody("bit", mass, np.array(com), np.diag(inertia), root), {"root"})
    for text in (part_of(body, path), six_digits(part_of(body, path))):
        path.write_text(text, encoding="utf-8")
        assert read_sid(path).mass == pytest.approx(mass, rel=1e-5)


def test_first_moments_of_no_mass_are_refused(tmp_path: Path) -> None:
    part = part_of(rigid(), tmp_path / "q.sid").replace("mass = 1.7", "mass = 0")
    assert "mdCM: with mass and J" in refusal(tmp_path / "q.sid", part)
