"""What the real arm differs in: masses of bodies, stiffness of beams and of sprung axes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flexarm_bringup.identify.fittable import fittable
from flexarm_bringup.sim.perturb import PlantSettings, perturb
from flexarm_model.manipulator.body_spec import Beam, RigidBody
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

ARM = """
format: flexarm/1
name: sprung
source: made up for the tests
gravity: [0 m/s^2, 0 m/s^2, 0 m/s^2]
bodies:
  rotor: {type: rigid, mass: 0 kg}
  lever: {type: rigid, mass: 2 kg, com: [0.5 m, 0 m, 0 m]}
  strip:
    type: beam
    pieces:
      - length: 300 mm
        section: {shape: rectangle, along_y: 2 mm, along_z: 20 mm}
        youngs_modulus: 70 GPa
        shear_modulus: 26 GPa
        density: 2700 kg/m^3
        elements: 4
    point_masses: [{name: end, at: 300 mm, mass: 100 g}]
    deformation: [bend_y]
    damping_ratio: 1 %
    nodes: {end: 300 mm}
    reduction: {method: craig_bampton, modes: 3, frame: clamped}
joints:
  base: {parent: world, child: rotor.root, axes: {rz: {actuated: true, rotor_inertia: 0.1 kg m^2}}}
  gear: {parent: rotor.root, child: lever.root, axes: {rz: {stiffness: 500 N m/rad}}}
  weld: {parent: lever.root, child: strip.root}
tip: strip.end
served: {modes: 2, home: [0 deg], rate: 200 Hz}
"""


@pytest.fixture
def config(tmp_path: Path) -> ManipulatorConfig:
    (tmp_path / "sprung.yaml").write_text(ARM, encoding="utf-8")
    return load_config(tmp_path / "sprung.yaml")


def _omega(config: ManipulatorConfig) -> np.ndarray:
    return linearize(ReducedTree(config, use_compiler=False)).omega


def test_all_frequencies_of_gears_and_beams_scale_together(config: ManipulatorConfig) -> None:
    real = perturb(config, PlantSettings(frequency_scale=0.9, extra_modes=0))
    assert _omega(real) == pytest.approx(0.9 * _omega(config), rel=1e-9)


def test_heavier_bodies_lower_the_frequencies_by_the_root_of_the_mass(config: ManipulatorConfig) -> None:
    real = perturb(config, PlantSettings(body_mass_scale=1.2, extra_modes=0))
    assert _omega(real) == pytest.approx(_omega(config) / np.sqrt(1.2), rel=1e-9)
    rotor = config.actuated["base.rz"].rotor_inertia
    assert real.actuated["base.rz"].rotor_inertia == rotor  # motors are known


def test_stretch_and_the_inertia_of_bodies_scale_with_the_rest(config: ManipulatorConfig) -> None:
    """A strip that stretches, with a rigidity of its own, on a lever that has an inertia of its own."""
    strip, lever = config.bodies["strip"], config.bodies["lever"]
    assert isinstance(strip, Beam) and isinstance(lever, RigidBody)
    pieces = tuple(replace(piece, axial_rigidity=5e4) for piece in strip.pieces)
    long = replace(strip, pieces=pieces, deformation=("bend_y", "stretch"))
    bodies = {**config.bodies, "strip": long, "lever": replace(lever, inertia=0.3 * np.eye(3))}
    arm = replace(config, bodies=bodies, modes=4)
    stiffer = perturb(arm, PlantSettings(frequency_scale=1.1, extra_modes=0))
    heavier = perturb(arm, PlantSettings(body_mass_scale=1.2, extra_modes=0))
    assert _omega(stiffer) == pytest.approx(1.1 * _omega(arm), rel=1e-9)
    assert _omega(heavier) == pytest.approx(_omega(arm) / np.sqrt(1.2), rel=1e-9)


def test_nothing_changes_without_being_asked(config: ManipulatorConfig) -> None:
    same = perturb(config, PlantSettings(extra_modes=0))
    assert same.joints[1].axes == config.joints[1].axes
    assert same.bodies["strip"] == config.bodies["strip"]


def test_damping_of_all_modes_scales_and_frequencies_stay(config: ManipulatorConfig) -> None:
    real = perturb(config, PlantSettings(damping_scale=1.8, extra_modes=0))
    before, after = (linearize(ReducedTree(each, use_compiler=False)) for each in (config, real))
    assert after.zeta == pytest.approx(1.8 * before.zeta, rel=1e-9)
    assert after.omega == pytest.approx(before.omega, rel=1e-12)


def test_the_factors_of_rayleigh_scale_with_the_rest(config: ManipulatorConfig) -> None:
    strip = config.bodies["strip"]
    assert isinstance(strip, Beam)
    damped = replace(strip, damping_rate=0.4, damping_time=1e-4)
    arm = replace(config, bodies={**config.bodies, "strip": damped})
    real = perturb(arm, PlantSettings(damping_scale=1.8, extra_modes=0))
    before, after = (linearize(ReducedTree(each, use_compiler=False)) for each in (arm, real))
    assert after.zeta == pytest.approx(1.8 * before.zeta, rel=1e-9)
    assert (before.zeta > linearize(ReducedTree(config, use_compiler=False)).zeta).all()


def test_the_factors_of_rayleigh_can_be_fitted(tmp_path: Path) -> None:
    path = tmp_path / "sprung.yaml"
    path.write_text(
        ARM.replace("damping_ratio: 1 %", "rayleigh: {alpha: 0.4 1/s, beta: 0 us}"), encoding="utf-8"
    )
    names = [name for name in fittable(path) if "damping" in name or "rayleigh" in name]
    assert names == ["bodies.strip.rayleigh.alpha=1.0"]  # one that is zero says that there is none


def test_a_beam_of_few_elements_keeps_what_it_has(config: ManipulatorConfig) -> None:
    """Three modes more than there are were asked for, and the arm could not be simulated."""
    strip = config.bodies["strip"]
    assert isinstance(strip, Beam)
    pieces = tuple(replace(piece, elements=2) for piece in strip.pieces)
    coarse = replace(config, bodies={**config.bodies, "strip": replace(strip, pieces=pieces)})
    tree = ReducedTree(perturb(coarse, PlantSettings()), use_compiler=False)
    assert tree.bodies["strip"].n == 4  # three, and not six


def test_damping_of_springs_of_axes_scales_and_friction_of_a_motor_does_not() -> None:
    config = load_config(find_manipulator("serial_6r"))
    real = perturb(config, PlantSettings(damping_scale=0.5))
    axes = [[axis for joint in arm.joints for axis in joint.axes] for arm in (config, real)]
    pairs = list(zip(*axes, strict=True))
    sprung = [(a.damping, b.damping) for a, b in pairs if a.stiffness]
    assert len(sprung) > 30 and all(old > 0.0 for old, _ in sprung)
    assert all(new == 0.5 * old for old, new in sprung)
    assert all(a.damping == b.damping for a, b in pairs if not a.stiffness)
