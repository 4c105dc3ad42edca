"""The file that a user names beside a rig that runs: is it of that arm?"""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

from flexarm_bringup.described import foreign_description
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

TWO_LINK = Path(__file__).parents[3] / "docs/two_link.yaml"


def test_a_description_that_is_named_and_is_of_another_arm_is_told_with_both_hashes(tmp_path: Path) -> None:
    """Its limits were "not known", as if no file had been named; most often one value is another."""
    light = load_config(find_manipulator("single_link"), "light_hub")
    served: Any = SimpleNamespace(manipulator="single_link", config_id=light.config_id, theta_names=())
    assert foreign_description("single_link", served) == ""
    assert foreign_description("somebody_elses", served) == ""
    other = foreign_description(str(TWO_LINK), served)
    assert other.startswith(f"another arm runs: 'single_link', config {light.config_id}, not {TWO_LINK}: ")
    assert other.endswith(f"'two_link', config {load_config(TWO_LINK).config_id}")
    changed = tmp_path / "mine.yaml"
    text = find_manipulator("single_link").read_text()
    changed.write_text(text.replace("lower: -170 deg", "lower: -160 deg"))
    assert changed.read_text() != text
    told = foreign_description(str(changed), served)
    assert f"not {changed}: 'single_link', config " in told
    assert f"{load_config(changed, 'light_hub').config_id} (preset light_hub)" in told
