"""What is fitted when nobody names anything, with the values in force."""

from __future__ import annotations

from pathlib import Path

from test_updating import ARM

from flexarm_bringup.identify.fittable import fittable
from flexarm_model.identification.described_modes import read_unknown
from flexarm_model.reading.manipulator_file import find_manipulator


def test_springs_that_follow_a_parameter_are_fitted_by_the_values_of_their_table() -> None:
    """Of an arm all of whose springs do, nothing suggested itself."""
    names = fittable(find_manipulator("variable_stiffness"))
    assert len(names) == 9
    assert "joints.elbow_spring.axes.rz.stiffness.values.1" in names
    assert "joints.elbow_spring.axes.rz.damping=1.0" in names


def test_of_an_imported_body_only_the_damping_suggests_itself(tmp_path: Path) -> None:
    """As the page of imported bodies says: its stiffness and mass are files."""
    path = tmp_path / "arm.yaml"
    path.write_text(ARM, encoding="utf-8")
    assert [name for name in fittable(path) if name.startswith("bodies.solid.")] == [
        "bodies.solid.damping_ratio=1.0"
    ]


def test_a_number_is_the_preset_s_where_that_overlays_what_holds_it() -> None:
    path, name = find_manipulator("variable_stiffness"), "joints.elbow_spring.axes.rz.stiffness.values.1"
    assert [read_unknown(path, preset, name, 0.3).unit for preset in ("", "rad")] == ["N m/deg", "N m/rad"]
    assert fittable(path, "rad") == fittable(path)
