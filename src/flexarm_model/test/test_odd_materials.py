"""What no material or section is gets said, and what none can be is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from arms import BAR, SINGLE_LINK, bar

from flexarm_model.manipulator.odd_materials import describe_odd_materials
from flexarm_model.reading.config import load_config
from flexarm_model.settings.strict_yaml import ConfigError

ODD = [
    ({"density": 2.7}, "density: 2.7 kg/m^3"),  # g/cm^3 written as kg/m^3
    ({"density": 2.7e6}, "density: 2.7e+06 kg/m^3"),
    ({"E": 70e6, "G": 26e6}, "youngs_modulus: 7e+07 Pa"),  # MPa for GPa
    ({"E": 70.0, "G": 26.0}, "youngs_modulus: 70 Pa"),
    ({"E": 7e13, "G": 2.6e13}, "youngs_modulus: 7e+13 Pa"),
    ({"G": 26e6}, "shear_modulus: 2.6e+07 Pa"),
    ({"G": 40e9}, "shear_modulus: 4e+10 Pa"),
    ({"area": 40.0}, "section: I_y and I_z"),
]
SOUND = [
    {},
    {"density": 0.0},  # springs alone
    {"E": 210e9, "G": 81e9, "density": 7850.0},
    {"E": 5e9, "G": 1.7e9, "density": 1100.0},
    {"E": 50e6, "G": 17e6, "density": 1000.0},  # a soft polymer, Poisson's ratio 0.47
]


@pytest.mark.parametrize(("changes", "said"), ODD)
def test_odd_figures_are_named_by_key(changes: dict[str, float], said: str) -> None:
    beam = replace(bar(), pieces=(BAR, replace(BAR, **changes)))  # type: ignore[arg-type]
    (found,) = describe_odd_materials({"bar": beam})
    assert found.startswith(f"bodies.bar.pieces.1.{said}")


@pytest.mark.parametrize("changes", SOUND)
def test_what_is_made_is_not_odd(changes: dict[str, float]) -> None:
    hub = replace(BAR, rigid=True, density=0.0, E=1.0, G=1.0)
    beam = replace(bar(), pieces=(hub, replace(BAR, **changes)))  # type: ignore[arg-type]
    assert describe_odd_materials({"bar": beam}) == ()


def test_a_torsion_constant_above_the_polar_moment_is_refused(tmp_path: Path) -> None:
    text, path = SINGLE_LINK.read_text(encoding="utf-8"), tmp_path / "arm.yaml"
    given = "{shape: given, area: 64 mm^2, I_y: 2133 mm^4, I_z: 54.6 mm^4, torsion_constant: J}"
    text = text.replace("{shape: rectangle, along_y: 3.2 mm, along_z: 20 mm}", given)
    path.write_text(text.replace("J}", "196 mm^4}"), encoding="utf-8")
    assert load_config(path).bodies
    path.write_text(text.replace("J}", "1 m^4}"), encoding="utf-8")
    with pytest.raises(
        ConfigError, match=r"torsion_constant: '1 m\^4': must be at most I_y \+ I_z, 2.1876e-09"
    ):
        load_config(path)
