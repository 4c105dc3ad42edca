"""Editing a description in place: only the value changes, and what is written is read back."""

from __future__ import annotations

import pytest
import yaml
from arms import SINGLE_LINK

from flexarm_model.identification.yaml_edit import add_items, edit_values
from flexarm_model.reading.config import load_config
from flexarm_model.settings.strict_yaml import ConfigError

TEXT = SINGLE_LINK.read_text()
STIFFNESS, MASS = "bodies.strip.pieces.0.youngs_modulus", "bodies.strip.point_masses.0.mass"


def test_only_the_lines_of_the_values_change() -> None:
    edited = edit_values(TEXT, {STIFFNESS: "156.4 GPa", MASS: "70 g"})
    changed = [
        (old, new) for old, new in zip(TEXT.splitlines(), edited.splitlines(), strict=True) if old != new
    ]
    assert len(changed) == 2
    assert all("156.4 GPa" in new or "70 g" in new for _, new in changed)


def test_a_value_that_a_preset_overlays_is_changed_there(tmp_path) -> None:
    inertia = "joints.base.axes.rz.rotor_inertia"
    path = tmp_path / "arm.yaml"
    path.write_text(edit_values(TEXT, {inertia: "0.02 kg m^2"}, "light_hub"))
    assert load_config(path, "light_hub").actuated["base.rz"].rotor_inertia == 0.02
    assert load_config(path, "geared").actuated["base.rz"].rotor_inertia == 0.30


def test_items_join_the_list_with_its_old_ones(tmp_path) -> None:
    path = tmp_path / "arm.yaml"
    path.write_text(add_items(TEXT, "fitted", ['E: 156 GPa "now"', "damping"]))
    fitted = load_config(path).fitted
    assert fitted[:-2] == load_config(SINGLE_LINK).fitted
    assert fitted[-2:] == ('E: 156 GPa "now"', "damping")


def test_a_missing_list_is_made() -> None:
    assert yaml.safe_load(add_items("a: 1\n", "fitted", ["x"])) == {"a": 1, "fitted": ["x"]}


def test_a_new_description_has_another_identity(tmp_path) -> None:
    path = tmp_path / "arm.yaml"
    path.write_text(edit_values(TEXT, {STIFFNESS: "156.4 GPa"}))
    assert load_config(path).config_id != load_config(SINGLE_LINK).config_id


@pytest.mark.parametrize("path", ["bodies.strip", "bodies.strip.nothing", "bodies.strip.pieces.7.density"])
def test_a_path_to_no_value_is_refused(path: str) -> None:
    with pytest.raises(ConfigError, match="no such value"):
        edit_values(TEXT, {path: "1"})
