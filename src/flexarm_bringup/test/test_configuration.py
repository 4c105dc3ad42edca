"""With what a bag was recorded: no file is written beside a user's, imported bodies are complete."""

import shutil
from pathlib import Path

import pytest
from bag_fixture import PERIOD_NS, WRITTEN, joint_state, write_bag
from imported_arm import write_arm

from flexarm_bringup.bags.bag_copy import copy_bag
from flexarm_bringup.bags.bag_reader import Bag, check_bag
from flexarm_bringup.bags.bag_recovery import recover_bag
from flexarm_bringup.bags.bag_writer import BagError, BagWriter
from flexarm_bringup.bags.configuration import configuration
from flexarm_bringup.bags.described_arm import files_to_keep
from flexarm_bringup.provenance import provenance
from flexarm_model.bodies.body_reduction import reduce_body
from flexarm_model.manipulator.imported_body import ImportedBody
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.settings.strict_yaml import ConfigError

SINGLE_LINK = find_manipulator("single_link")


def record(folder: Path, path: Path, **changes: str) -> Bag:
    """Record one message of an arm, with what the recorder keeps of it."""
    about = {**provenance(path.stem, path, "", "{}"), **changes}
    with BagWriter(folder, WRITTEN, about, files=files_to_keep(path)) as writer:
        writer.write("/flexarm/joint_states", PERIOD_NS, joint_state(PERIOD_NS, 0.1))
    return check_bag(folder)


@pytest.mark.parametrize("name", ["arms/my_arm.yaml", "../../x/y", "a" * 300, "a\0b", ""])
def test_the_name_that_a_bag_gives_its_arm_decides_on_no_path(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for given in (name, str(tmp_path / "arms" / "mine")):
        (tmp_path / "arms").mkdir()
        bag = record(tmp_path / "bag", SINGLE_LINK, manipulator=given)
        assert configuration(bag)[0].name == load_config(SINGLE_LINK).name
        assert not list((tmp_path / "arms").iterdir())
        shutil.rmtree(tmp_path / "bag")
        (tmp_path / "arms").rmdir()


def test_a_description_without_files_keeps_none(tmp_path: Path) -> None:
    assert files_to_keep(SINGLE_LINK) == {}
    record(tmp_path / "bag", SINGLE_LINK)
    assert not (tmp_path / "bag" / "description").exists()


@pytest.mark.parametrize("meshes", ["", "meshes/", "../meshes/"])
def test_the_files_of_imported_bodies_are_kept_in_the_bag(meshes: str, tmp_path: Path) -> None:
    path = write_arm(tmp_path / "mine" / "arms" / "arm.yaml", meshes)
    described = load_config(path)
    bag = record(tmp_path / "bag", path)
    shutil.rmtree(tmp_path / "mine")
    copied = copy_bag(bag, tmp_path / "copy", bag.records)
    (tmp_path / "bag" / "metadata.yaml").unlink()
    recovered = recover_bag(tmp_path / "bag", tmp_path / "recovered").bag
    shutil.rmtree(tmp_path / "bag")
    assert recovered.records == bag.records
    found = configuration(copied)[0]
    assert found.config_id == described.config_id
    body = found.bodies["solid"]
    assert isinstance(body, ImportedBody)
    assert body.mass.path.resolve().is_relative_to((tmp_path / "copy").resolve())
    assert reduce_body(body, {"root"}).n == 3  # modes, of matrices that are in the copy


def test_a_bag_without_the_files_that_its_description_names_says_so(tmp_path: Path) -> None:
    bag = record(tmp_path / "bag", write_arm(tmp_path / "arm.yaml", "meshes/"))
    shutil.rmtree(tmp_path / "bag" / "description")
    names = "meshes/mass.mtx, meshes/nodes.csv, meshes/root.txt, meshes/rows.txt, meshes/stiffness.mtx"
    with pytest.raises(BagError) as caught:
        configuration(bag)
    assert str(caught.value) == f"{bag.path}: its description names files that it lacks: {names}"


def test_a_wrong_description_is_told_with_the_bag_that_has_it(tmp_path: Path) -> None:
    for name, changes in {"text": {"description": "foo: ["}, "preset": {"preset": "nope"}}.items():
        bag = record(tmp_path / name, SINGLE_LINK, **changes)
        with pytest.raises(ConfigError) as caught:
            configuration(bag)
        assert str(caught.value).startswith(f"{bag.path}: its description: ")
        assert "bag.yaml" not in str(caught.value)


@pytest.mark.parametrize(
    "settings", ["[1, 2]", "3", "null", '{"estimator": 3}', '[["estimator", 3]]', "{", ""]
)
def test_settings_that_are_none_are_refused(settings: str, tmp_path: Path) -> None:
    bag = record(tmp_path / "bag", SINGLE_LINK, settings=settings)
    with pytest.raises(BagError, match="its settings are not"):
        configuration(bag)


def test_a_bag_that_does_not_say_what_it_was_recorded_with_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="does not say with which description, preset, settings"):
        configuration(check_bag(write_bag(tmp_path / "bag")))
