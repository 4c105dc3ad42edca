"""A bag that does not say its arm, as of ``ros2 bag record``, is identified as of the arm that is named."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from flexarm_bringup import cli
from flexarm_bringup.bags.bag_copy import copy_bag
from flexarm_bringup.bags.bag_reader import check_bag
from flexarm_bringup.identify.bag_source import read_bag
from flexarm_bringup.identify.measurement import SourceError
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

GOLDEN = Path(__file__).resolve().parents[3] / "tests" / "golden" / "single_link" / "bag"


def test_a_bag_that_does_not_say_its_arm_is_read_as_of_the_one_that_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It was refused with and without --manipulator."""
    golden, path = check_bag(GOLDEN), tmp_path / "bag"
    copy_bag(replace(golden, custom={}), path, golden.records)
    arm = load_config(find_manipulator("single_link"), "geared")
    found, said = read_bag(path, otherwise=arm), read_bag(GOLDEN, otherwise=None)
    assert list(found.outputs) == list(said.outputs) and list(found.inputs) == ["base.rz"]
    with pytest.raises(SourceError, match="does not say with which description"):
        read_bag(path)
    words = ["identify", str(path), "--manipulator", "single_link", "--resolution", "4"]
    assert cli.main(words) in (0, 1)
    assert "3 output(s), 1 input(s)" in capsys.readouterr().out
