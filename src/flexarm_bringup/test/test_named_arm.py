"""A bag that does not say its arm is told it; one that does keeps to it, whoever opens it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from flexarm_bringup import cli
from flexarm_bringup.bags.bag_copy import copy_bag
from flexarm_bringup.bags.bag_reader import check_bag
from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.bags.configuration import configuration
from flexarm_bringup.bags.named_arm import NamedArm, open_bag
from flexarm_bringup.tasks.task import find_task
from flexarm_model.settings.strict_yaml import ConfigError

pytestmark = [pytest.mark.ros, pytest.mark.unhurried]
pytest.importorskip("flexarm_bringup.conversions", reason="needs ROS and flexarm_interfaces")

GOLDEN = Path(__file__).resolve().parents[3] / "tests" / "golden" / "single_link" / "bag"
COMMANDS = ("ablate", "tune", "smooth", "drift", "replay")


@pytest.fixture(scope="module")
def silent(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the golden bag as of ``ros2 bag record``: it says nothing of its arm."""
    golden, path = check_bag(GOLDEN), tmp_path_factory.mktemp("silent") / "bag"
    copy_bag(replace(golden, custom={}), path, golden.records)
    return path


@pytest.fixture(scope="module")
def moves(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a moves file of the arm as it was described when the golden bag was recorded."""
    folder = tmp_path_factory.mktemp("arm")
    arm, path = folder / "single_link.yaml", folder / "moves.yaml"
    arm.write_text(check_bag(GOLDEN).custom["description"], encoding="utf-8")
    shipped = find_task("single_link").read_text(encoding="utf-8")
    path.write_text(shipped.replace("manipulator: single_link", f"manipulator: {arm}"), encoding="utf-8")
    return path


def test_the_arm_that_is_named_is_the_one_of_the_bag_with_the_settings_of_its_moves(
    silent: Path, moves: Path
) -> None:
    config, settings = configuration(open_bag(silent, arm=NamedArm(str(moves))))
    said = configuration(check_bag(GOLDEN))[0]
    assert (config.config_id, config.preset) == (said.config_id, said.preset)
    assert settings["estimator"]["stiffness_modes"] == 2 and settings["controller"]["delay_periods"] == 2


def test_an_arm_of_ones_own_is_named_by_its_path(silent: Path) -> None:
    arm = Path(__file__).parents[3] / "docs" / "two_link.yaml"
    assert configuration(open_bag(silent, arm=NamedArm(str(arm))))[0].name == "two_link"


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_on_bags_says_how_to_name_the_arm_and_takes_it(
    command: str, silent: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main([command, str(silent)]) == 2
    assert "does not say with which description" in (said := capsys.readouterr().err)
    assert "--manipulator NAME names its arm" in said
    assert cli.main([command, str(silent), "--manipulator", "no_such_arm"]) == 2
    assert "no_such_arm" in capsys.readouterr().err
    assert cli.main([command, str(silent), "--preset", "geared"]) == 2
    assert "--preset: goes with --manipulator NAME" in capsys.readouterr().err
    assert cli.main([command, str(GOLDEN), "--manipulator", "single_link"]) == 2
    assert "says of which arm it is" in capsys.readouterr().err


def test_a_named_bag_is_replayed(silent: Path, moves: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["replay", str(silent), "--manipulator", str(moves)]) == 0
    assert "/flexarm/modal_state" in capsys.readouterr().out


def test_another_arm_or_preset_than_there_is_cannot_be_named(silent: Path) -> None:
    with pytest.raises(ConfigError, match="preset"):
        open_bag(silent, arm=NamedArm("single_link", "nosuch"))
    with pytest.raises(BagError, match="says of which arm it is"):
        open_bag(GOLDEN, arm=NamedArm("single_link"))
