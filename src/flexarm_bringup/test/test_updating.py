"""A fitted description is written whole or not at all, and finds its files from where it is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml
from small_arm import small_arm

from flexarm_bringup import cli
from flexarm_bringup.identify.fingerprint import fingerprint
from flexarm_bringup.identify.fitted_file import write_description
from flexarm_bringup.identify.updating import Fitting, update_table
from flexarm_model.fe_import.hexahedra import Material, make_solid, write_solid
from flexarm_model.identification.model_update import Update
from flexarm_model.identification.unknown import Unknown, changed
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

DENSITY = "bodies.payload.mass"
ARM = """
format: flexarm/1
name: solid_arm
source: made up for the tests
gravity: [0 m/s^2, 0 m/s^2, -9.81 m/s^2]
bodies:
  solid: &solid  # a block
    type: imported
    mass: {file: parts/mass.mtx}
    stiffness: {file: 'parts/stiffness.mtx'}
    nodes: parts/nodes.csv
    units: {length: m, mass: kg}
    interfaces:
      root: {set: parts/root.txt, kind: rigid}
      end: {set: parts/end.txt, kind: rigid}
    damping_ratio: 0.01
    reduction: {method: guyan}
  payload: {type: rigid, mass: 200 g, nodes: {far: [10 mm, 0 mm, 0 mm]}}
joints:
  base: {parent: world, child: solid.root, axes: {rz: {actuated: true}}}
  flange: {parent: solid.end, child: payload.root}
tip: payload.far
served: {modes: 1, home: [0 deg], rate: 200 Hz}
presets:
  again: {bodies.solid.mass.file: parts/mass.mtx, served.modes: 1}
"""
ONE = np.ones((1, 1))


def write_arm(folder: Path) -> Path:
    """Write the arm, with its files in a folder beside it."""
    parts = folder / "parts"
    parts.mkdir(parents=True)
    solid = make_solid(
        np.ones((4, 1, 1), dtype=bool), np.full(3, 0.02), Material(E=70e9, nu=0.3, density=2700.0)
    )
    x = solid.x[:, 0]
    labels = {
        "root": solid.select(lambda p: p[0] < 1e-9),
        "end": solid.select(lambda p: p[0] > x.max() - 1e-9),
    }
    write_solid(solid, parts, labels, ".mtx")
    path = folder / "arm.yaml"
    path.write_text(ARM, encoding="utf-8")
    return path


def fitted(value: str = "250 g", refused: tuple[str, ...] = ()) -> Update:
    """Return what a fit says of the payload."""
    unknown = Unknown(DENSITY, 200.0, "g", 0.3)
    small = np.full(1, 0.01)
    return Update((unknown,), small, small, ONE, ONE, small, small, {DENSITY: value}, refused)


@pytest.mark.parametrize("preset", ["", "again"])
@pytest.mark.parametrize("place", ["mine.yaml", "fits/mine.yaml", "../mine.yaml"])
def test_files_of_bodies_are_found_from_where_the_fitted_description_is(
    place: str, preset: str, tmp_path: Path
) -> None:
    path = write_arm(tmp_path / "arms")
    (tmp_path / "arms" / "fits").mkdir()
    output = path.parent / place
    assert f"wrote {output}" in write_description(Fitting(str(path), preset, (), output=output), fitted(), [])
    new, old = load_config(output, preset), load_config(path, preset)
    assert new.bodies["payload"].mass == 0.25 and new.bodies["solid"].digest == old.bodies["solid"].digest
    assert "# a block" in output.read_text()
    (path.parent / "parts").rename(tmp_path / "arms" / "gone")
    with pytest.raises(ValueError, match="cannot be read"):
        load_config(output)  # they are the same files, not others that happen to be there


def test_absolute_names_and_those_beside_it_stay_as_they_are(tmp_path: Path) -> None:
    path = write_arm(tmp_path)
    path.write_text(ARM.replace("nodes: parts/", f"nodes: {tmp_path}/parts/"), encoding="utf-8")
    bodies = yaml.safe_load(path.read_text())["bodies"]["solid"]
    output = tmp_path / "mine.yaml"
    write_description(Fitting(str(path), "", (), output=output), fitted(), [])
    assert yaml.safe_load(output.read_text())["bodies"]["solid"] == bodies


@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
def test_a_description_keeps_the_line_ends_it_has(mark: bytes, tmp_path: Path) -> None:
    """One from Windows came back with every line changed."""
    path, output = write_arm(tmp_path), tmp_path / "mine.yaml"
    path.write_bytes(mark + path.read_bytes().replace(b"\n", b"\r\n"))
    write_description(Fitting(str(path), "", (), output=output), fitted(), [])
    before, after = (each.read_bytes().splitlines(keepends=True) for each in (path, output))
    assert all(line.endswith(b"\r\n") and line.count(b"\r") == 1 for line in after)
    assert len(set(after) - set(before)) <= 4  # the value, a blank line, and the list of what was fitted


def test_a_description_whose_lines_end_in_several_ways_keeps_them_all(tmp_path: Path) -> None:
    """All of its lines came back with the end of the first one."""
    path, output = write_arm(tmp_path), tmp_path / "mine.yaml"
    for ends in ((b"\r\n", b"\n"), (b"\n", b"\r\n", b"\n")):
        lines = ARM.encode().splitlines()
        path.write_bytes(b"".join(line + ends[k % len(ends)] for k, line in enumerate(lines)))
        write_description(Fitting(str(path), "", (), output=output), fitted(), [])
        before, after = (each.read_bytes().split(b"\n") for each in (path, output))
        changed_lines = [k for k, line in enumerate(before[:-1]) if after[k] != line]
        assert [b"payload" in before[k] for k in changed_lines] == [True]
        assert after[changed_lines[0]].endswith(b"\r") is before[changed_lines[0]].endswith(b"\r")
        assert {line.endswith(b"\r") for line in after[len(before) - 1 : -1]} == {ends[0] == b"\r\n"}


def test_a_description_that_cannot_be_used_does_not_replace_one_that_can(tmp_path: Path) -> None:
    path = write_arm(tmp_path)
    with pytest.raises(ValueError, match="mass"):
        write_description(Fitting(str(path), "", (), output=path), fitted("-1 g"), [])
    assert path.read_text() == ARM and sorted(item.name for item in tmp_path.iterdir()) == [
        "arm.yaml",
        "parts",
    ]


def test_a_description_written_over_itself_tells_both_models(tmp_path: Path) -> None:
    path = write_arm(tmp_path)
    said = write_description(Fitting(str(path), "", (), output=path), fitted(), [])
    new, old = said.partition("model ")[2][:16], said.partition("was ")[2][:16]
    assert new != old and load_config(path).bodies["payload"].mass == 0.25


def test_trials_without_a_model_are_told() -> None:
    notes = update_table(fitted(refused=("p = 1: far", "p = 2: no stable equilibrium"))).notes
    assert "stepped back from values without a model: p = 2: no stable equilibrium" in notes


def write_bag(folder: Path) -> Path:
    """Write the files of a bag, with something in them."""
    folder.mkdir()
    for name in ("metadata.yaml", "data_0.mcap", "data_1.mcap", "sha256"):
        (folder / name).write_text(f"{name} of a run")
    return folder


def test_the_bag_that_a_fit_rests_on_is_told_with_its_hash(tmp_path: Path) -> None:
    path, bag = write_arm(tmp_path / "arms"), write_bag(tmp_path / "run_3")
    output = tmp_path / "mine.yaml"
    write_description(Fitting(str(path), "", (), output=output), fitted(), [bag])
    assert f"run_3 (sha256 {fingerprint(bag)})" in load_config(output).fitted[0]


@pytest.mark.parametrize(
    ("name", "is_of_the_bag"), [("metadata.yaml", True), ("data_1.mcap", True), ("notes.txt", False)]
)
def test_the_hash_of_a_bag_is_of_what_was_recorded(name: str, is_of_the_bag: bool, tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "run_3")
    before = fingerprint(bag)
    (bag / name).write_text("something else")
    assert len(before) == 12 and (fingerprint(bag) != before) is is_of_the_bag


def test_a_description_that_cannot_be_written_is_refused_before_the_test(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """That its list of fits cannot be added to was told after it, and an error of YAML lost the page."""
    arm = small_arm(tmp_path)
    arm.write_text(f"fitted: &told\n  - old\nassumed: *told\n{arm.read_text()}", encoding="utf-8")
    words = ["--manipulator", str(arm), "--fit", "bodies.strip.damping_ratio"]
    assert cli.main(["identify", "rig", *words, "--update", str(tmp_path / "mine.yaml")]) == 2
    told = capsys.readouterr().err
    assert told == f"flexarm identify: {arm}: 'fitted': cannot be added to as it is written\n"


def test_equal_parts_are_written_one_by_one(tmp_path: Path) -> None:
    """What one anchor holds for all legs is the same number in every one of them afterwards."""
    path, output = find_manipulator("planar_3rrr"), tmp_path / "fitted.yaml"
    names = [f"bodies.first_{leg}.point_masses.0.mass" for leg in (1, 2, 3)]
    unknown = Unknown(names[0], 53.0, "g", 0.3, equals=tuple(names[1:]))
    small = np.full(1, 0.1)
    update = Update((unknown,), small, small, ONE, ONE, small, small, changed([unknown], small))
    assert "first_1,first_2,first_3" in update_table(update).rows[0][0]
    write_description(Fitting(str(path), "", (), output=output), update, [])
    bodies = yaml.safe_load(output.read_text(encoding="utf-8"))["bodies"]
    assert {bodies[f"first_{leg}"]["point_masses"][0]["mass"] for leg in (1, 2, 3)} == {unknown.text(0.1)}
    fitted_list = yaml.safe_load(output.read_text(encoding="utf-8"))["fitted"]
    assert sum("as one with its equal parts" in item for item in fitted_list) == 3
