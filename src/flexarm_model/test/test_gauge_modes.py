"""Gauges that the kept modes of a beam tell wrongly are named, and those of the shipped arms are not."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from descriptions import write_arm

from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.gauge_modes import describe_gauge_modes
from flexarm_model.served.linearize import linearize
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.reduced_tree import ReducedTree

TWO_LINK = Path(__file__).resolve().parents[3] / "docs" / "two_link.yaml"


def link(mass: str, pin: str) -> dict[str, Any]:
    inertia = [*["1e-3 kg m^2"] * 3, *["0 kg m^2"] * 3]
    return {
        "type": "rigid",
        "mass": mass,
        "com": ["75 mm", "0 mm", "0 mm"],
        "inertia": inertia,
        "nodes": {"pin": [pin, "0 mm", "0 mm"]},
    }


def four_bar(folder: Path, **reduction: Any) -> ManipulatorConfig:
    """Return a geared four-bar linkage whose coupler goes on behind its second pin, a gauge between both."""
    strip = {"shape": "rectangle", "along_y": "5 mm", "along_z": "30 mm"}
    piece = {"length": "600 mm", "section": strip, "youngs_modulus": "70 GPa", "density": "2700 kg/m^3"}
    coupler = {
        "type": "beam",
        "pieces": [{**piece, "elements": 12}],
        "point_masses": [{"name": "tool", "at": "600 mm", "mass": "200 g"}],
        "deformation": ["bend_y"],
        "damping_ratio": "1 %",
        "nodes": {"gauge": "200 mm", "pin": "400 mm", "tip": "600 mm"},
        "reduction": {"method": "craig_bampton", "frame": "clamped", **reduction},
    }
    motor = {"actuated": True, "rotor_inertia": "0.02 kg m^2", "effort": "20 N m"}
    gauge = {
        "kind": "strain_gauge",
        "node": "coupler.gauge",
        "offset": ["2.5 mm", "0 mm"],
        "sigma": "1 ustrain",
    }
    gear = {"stiffness": "3000 N m/rad", "damping": "0.5 N m s/rad"}
    links = {"crank": link("500 g", "150 mm"), "coupler": coupler, "rocker": link("600 g", "300 mm")}
    content = {
        "format": "flexarm/1",
        "name": "four_bar",
        "source": "made up for the tests",
        "gravity": ["0 m/s^2", "-9.81 m/s^2", "0 m/s^2"],
        "bodies": {"rotor": {"type": "rigid", "mass": "0 kg"}, **links},
        "joints": {
            "motor": {"parent": "world", "child": "rotor.root", "axes": {"rz": motor}},
            "gear": {"parent": "rotor.root", "child": "crank.root", "axes": {"rz": gear}},
            "crank": {"parent": "crank.pin", "child": "coupler.root", "axes": {"rz": {"guess": "-70 deg"}}},
            "ground": {
                "parent": "world",
                "child": "rocker.root",
                "position": ["400 mm", "0 mm", "0 mm"],
                "axes": {"rz": {"guess": "80 deg"}},
            },
            "close": {"parent": "coupler.pin", "child": "rocker.pin", "axes": {"rz": {"guess": "60 deg"}}},
        },
        "sensors": {"mid": {**gauge, "sigma": "1 ustrain"}},
        "tip": "coupler.tip",
        "served": {"modes": 2, "home": ["80 deg"], "rate": "200 Hz"},
    }
    return load_config(write_arm(folder, content))


def served(config: ManipulatorConfig) -> ReducedModel:
    return linearize(ReducedTree(config, use_compiler=False))


def reach(model: ReducedModel) -> np.ndarray:
    (row,) = model.outputs.rows("mid")
    return np.array([1e6 * model.outputs.y0[row], *abs(model.outputs.C_pos[row, 1:] / model.omega)])


def test_a_gauge_between_pins_wants_more_modes_than_the_frequencies_do(tmp_path: Path) -> None:
    """The tip was told 0.1 mm off for good, by a filter that was sure of 27 um, and nothing said why."""
    models = {modes: served(four_bar(tmp_path, modes=modes)) for modes in (3, 6, 18)}
    for modes, model in models.items():
        rest, first, second = reach(model)
        print(
            f"modes {modes:2d}: {model.omega / 2 / np.pi} Hz, {rest:.1f} ustrain at rest, "
            f"mode 2 makes {second / first:.2f} of mode 1"
        )
    np.testing.assert_allclose(models[3].omega, models[18].omega, rtol=0.025)
    assert abs(reach(models[3])[0] - reach(models[18])[0]) > 2.0
    (said,) = describe_gauge_modes(four_bar(tmp_path, modes=3), models[3])
    assert "mid 19.4 ustrain at rest for 16.5, mode 2 off by 43 % of the largest (has 3)" in said
    assert describe_gauge_modes(four_bar(tmp_path, modes=6), models[6]) == ()
    np.testing.assert_allclose(reach(models[6]), reach(models[18]), rtol=0.05)


@pytest.mark.parametrize(
    "reduction", [{"method": "guyan"}, {"f_max": "100 Hz"}, {"modes": 2, "method": "guyan"}]
)
def test_static_shapes_are_judged_as_well(reduction: dict[str, Any], tmp_path: Path) -> None:
    config = four_bar(tmp_path, **reduction)
    (said,) = describe_gauge_modes(config, served(config))
    assert "mid" in said


@pytest.mark.parametrize(
    "arm",
    ["single_link", "planar_3rrr", "spatial_3tpt", "serial_6r", "variable_stiffness"]
    + [pytest.param(str(TWO_LINK), id="two_link")],
)
def test_gauges_of_arms_that_came_along_are_told_rightly(arm: str) -> None:
    """Of the 3RRR two modes each have one frequency, and are any mixture."""
    config = load_config(find_manipulator(arm))
    assert describe_gauge_modes(config, served(config)) == ()
