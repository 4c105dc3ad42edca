"""A beam that goes through a file of standard input data is damped as the beam is, in every pose."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from arms import FOLDER

from flexarm_model.bodies.sid_file import read_sid, write_sid
from flexarm_model.reading.config import load_config
from flexarm_model.served.linearize import linearize
from flexarm_model.settings.strict_yaml import ConfigError
from flexarm_model.tree.reduced_tree import ReducedTree

ARM = FOLDER.parents[3] / "docs/two_link.yaml"
BEAMS = ("upper", "forearm")


def older(text: str, version: int) -> str:
    """Return a file with a block of versions 1 or 2, whose digest is of the part before the block."""
    part, _, own = text.partition("\nflexarm\n")
    digest = hashlib.sha256("\n".join(line.strip() for line in part.splitlines()).encode()).hexdigest()[:16]
    own = re.sub(r"damping_rate = .*\n", "", own.replace("version = 4\n", f"version = {version}\n"))
    own = re.sub(r"digest = \w+", f"digest = {digest}", own)
    return f"{part}\nflexarm\n{own}"


def through_files(folder: Path, tree: ReducedTree) -> Path:
    """Write both beams of the arm and return a description that reads them."""
    content = yaml.safe_load(ARM.read_text(encoding="utf-8"))
    for name in BEAMS:
        write_sid(tree.bodies[name], folder / f"{name}.sid")
        content["bodies"][name] = {"type": "superelement", "file": f"{name}.sid"}
    path = folder / "arm.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    return path


def test_the_modes_of_an_arm_of_written_beams_have_the_ratios_of_the_beams(tmp_path: Path) -> None:
    """1 % is said of every mode that the arm has; the matrix De alone means 1 % of the beam by itself."""
    tree = ReducedTree(load_config(ARM), use_compiler=False)
    path = through_files(tmp_path, tree)
    for theta in (None, np.radians([0.0, 10.0])):
        expected = linearize(tree, theta)
        model = linearize(ReducedTree(load_config(path), use_compiler=False), theta)
        assert np.array_equal(model.zeta, expected.zeta) and np.array_equal(model.omega, expected.omega)
    assert linearize(tree).zeta == pytest.approx(0.01, rel=1e-9)


def test_a_file_of_the_first_version_and_a_foreign_one_have_the_damping_matrix(tmp_path: Path) -> None:
    tree = ReducedTree(load_config(ARM), use_compiler=False)
    arm = through_files(tmp_path, tree)
    for name in BEAMS:
        path = tmp_path / f"{name}.sid"
        text = path.read_text(encoding="utf-8")
        first = older(text, 1).replace("damping_ratio = 0.01\n", "")
        for content in (text.partition("\nflexarm\n")[0] + "\n", first):
            path.write_text(content, encoding="utf-8")
            back = read_sid(path)
            assert back.damping_ratio == 0.0
            assert np.array_equal(back.D, np.diag(2 * 0.01 * tree.bodies[name].omega))
    zeta = linearize(ReducedTree(load_config(arm), use_compiler=False)).zeta
    assert zeta == pytest.approx([0.0020, 0.0084, 0.0213, 0.0093], abs=5e-5)  # docs/sid_file.md


def test_a_block_of_another_version_or_without_its_ratio_is_refused(tmp_path: Path) -> None:
    through_files(tmp_path, ReducedTree(load_config(ARM), use_compiler=False))
    path = tmp_path / "upper.sid"
    text = older(path.read_text(encoding="utf-8"), 2)
    for old, new, expected in (
        ("version = 2\n", "version = 5\n", "flexarm: version = 5: expected a whole number from 1 to 4"),
        ("damping_ratio = 0.01\n", "", "flexarm: 'damping_ratio = <number>' is missing"),
    ):
        path.write_text(text.replace(old, new), encoding="utf-8")
        with pytest.raises(ConfigError, match=expected):
            read_sid(path)
