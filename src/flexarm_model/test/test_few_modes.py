"""Bodies with too few modes for their static shapes lose what the arm swings on first, and are named."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from descriptions import write_arm
from fe_beams import RIGID, strip
from fe_bodies import block, description, ends, load_arm

from flexarm_model.bodies.few_modes import bodies_with_few_modes, describe_few_modes
from flexarm_model.fe_import.hexahedra import write_solid
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.served.linearize import linearize
from flexarm_model.settings.units import RAD_PER_HZ
from flexarm_model.tree.reduced_tree import ReducedTree

MOTOR = {"rz": {"actuated": True, "effort": "20 N m", "rotor_inertia": "0.05 kg m^2"}}
TUBE = {"shape": "tube", "outer_diameter": "20 mm", "inner_diameter": "16 mm"}
STATIC = 5  # along y and z, about x, y and z


def tube(**reduction: Any) -> dict[str, Any]:
    piece = {"length": "0.4 m", "section": TUBE, "youngs_modulus": "70 GPa", "density": "2700 kg/m^3"}
    return {
        "type": "beam",
        "pieces": [{**piece, "elements": 8}],
        "deformation": ["bend_y", "bend_z", "torsion"],
        "damping_ratio": "1 %",
        "nodes": {"end": "0.4 m"},
        "reduction": {"method": "craig_bampton", **reduction},
    }


def elbow_arm(folder: Path, **reduction: Any) -> ManipulatorConfig:
    """Return two tubes at a right angle, 0.5 kg at the end, the first one reduced as said."""
    load = {"type": "rigid", "mass": "0.5 kg", "inertia": [*["1e-3 kg m^2"] * 3, *["0 kg m^2"] * 3]}
    content = {
        "format": "flexarm/1",
        "name": "elbow",
        "source": "made up for the tests",
        "gravity": ["0 m/s^2"] * 3,
        "bodies": {"upper": tube(**reduction), "forearm": tube(modes=12), "load": load},
        "joints": {
            "shoulder": {"parent": "world", "child": "upper.root", "axes": MOTOR},
            "elbow": {"parent": "upper.end", "child": "forearm.root", "axes": MOTOR},
            "weld": {"parent": "forearm.end", "child": "load.root"},
        },
        "tip": "load.root",
        "served": {"modes": 3, "home": ["0 deg", "90 deg"], "rate": "500 Hz"},
    }
    return load_config(write_arm(folder, content))


def f_hz(config: ManipulatorConfig) -> np.ndarray:
    return linearize(ReducedTree(config, use_compiler=False)).omega / RAD_PER_HZ


def test_a_beam_of_fewer_modes_than_static_shapes_is_named_and_the_number_told_is_enough(
    tmp_path: Path,
) -> None:
    """With four the arm's slowest mode was gone: 12.2 Hz came first, and nothing said so."""
    found = {modes: f_hz(elbow_arm(tmp_path, modes=modes)) for modes in (12, 5, 4, 3, 2, 1)}
    for modes, hz in found.items():
        print(f"modes {modes:2d}: {', '.join(f'{f:.3f}' for f in hz)} Hz")
    assert found[STATIC] == pytest.approx(found[12], rel=2e-3)  # the fixed-interface modes are far above
    assert found[4][0] == pytest.approx(found[12][1], rel=1e-3)
    assert bodies_with_few_modes(elbow_arm(tmp_path, modes=4)) == {"upper": (4, STATIC)}
    (said,) = describe_few_modes(elbow_arm(tmp_path, modes=4))
    assert said.endswith("expected reduction.modes of at least: upper 5 (has 4)")


@pytest.mark.parametrize(
    "reduction", [{"modes": STATIC}, {"f_max": "1 Hz"}, {"method": "guyan"}, {"method": "guyan", "modes": 5}]
)
def test_a_body_that_keeps_all_its_static_shapes_is_not_named(
    reduction: dict[str, Any], tmp_path: Path
) -> None:
    assert describe_few_modes(elbow_arm(tmp_path, **reduction)) == ()


def test_static_shapes_alone_can_be_too_few_as_well(tmp_path: Path) -> None:
    assert bodies_with_few_modes(elbow_arm(tmp_path, method="guyan", modes=3)) == {"upper": (3, STATIC)}


@pytest.mark.parametrize(
    ("reduction", "named"),
    [
        ({"modes": 6}, {"solid": (6, 7)}),
        ({"modes": 7}, {}),
        ({"modes": 5, "method": "guyan"}, {"solid": (5, 6)}),
        ({"modes": 6, "method": "guyan"}, {}),
        ({"f_max": "1 kHz"}, {}),
    ],
)
def test_an_imported_body_has_six_static_shapes_for_each_interface(
    reduction: dict[str, Any], named: dict[str, tuple[int, int]], tmp_path: Path
) -> None:
    reduction = {"method": "craig_bampton", **reduction}
    config = load_arm(tmp_path, strip(4), interfaces=RIGID, reduction=reduction)
    assert bodies_with_few_modes(config) == named


def test_an_imported_body_of_few_modes_is_wrong_under_a_load_far_from_its_interface(
    tmp_path: Path,
) -> None:
    """The manual called it a little stiff. A block of 0.4 m that bears 0.5 kg 0.4 m beside its end twists."""
    solid, found = block(), {}
    write_solid(solid, tmp_path, ends(solid), ".mtx")
    for modes in (30, 7, 6, 3):
        content = description(reduction={"method": "craig_bampton", "modes": modes})
        content["bodies"]["payload"].update({"mass": "0.5 kg", "com": ["0 m", "0.4 m", "0 m"]})
        content["served"]["modes"] = 3
        found[modes] = f_hz(load_config(write_arm(tmp_path, content)))
        print(f"modes {modes:2d}: {', '.join(f'{f:.2f}' for f in found[modes])} Hz")
    assert found[7] == pytest.approx(found[30], rel=2e-3)  # the fixed-interface modes are far above
    assert found[6][0] > 1.4 * found[30][0] and found[3][0] > 1.6 * found[30][0]
