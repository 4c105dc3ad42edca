"""Blades that sag: what shapes of second order leave out, as one beam and as several welded ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from test_trees_agree import equilibrium, locked

from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.segments.segment_tree import SegmentTree
from flexarm_model.served.linearize import find_equilibrium
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
ELEMENTS, MODES = 12, 3  # of the whole blade; compared
ARM = """
format: flexarm/1
name: blade
source: made up for a test
gravity: [0 m/s^2, 0 m/s^2, -9.81 m/s^2]
bodies:
BODIES
  load:
    type: rigid
    mass: LOAD kg
    inertia: [1e-4 kg m^2, 1e-4 kg m^2, 1e-4 kg m^2, 0 kg m^2, 0 kg m^2, 0 kg m^2]
joints:
  pitch:
    parent: world
    child: part_0.root
    axes: {ry: {actuated: true, rotor_inertia: 1 kg m^2, effort: 60 N m}}
WELDS
sensors: {encoder: {kind: encoder, axis: pitch.ry, sigma: 1 urad}}
tip: load.root
served: {modes: 3, home: [0 deg], rate: 500 Hz}
"""
PART = """  part_NUMBER:
    type: beam
    pieces:
      - length: LENGTH mm
        section: {shape: rectangle, along_y: WIDE mm, along_z: HIGH mm}
        youngs_modulus: 70 GPa
        shear_modulus: 26 GPa
        density: 2700 kg/m^3
        elements: ELEMENTS
    deformation: [bend_y, bend_z, torsion]
    damping_ratio: 1 %
    nodes: {end: LENGTH mm}
    reduction: {method: craig_bampton, modes: 10, frame: clamped}
"""


def blade(folder: Path, wide: float, high: float, load: float, parts: int) -> ManipulatorConfig:
    """Return a blade of 1 m [mm, mm, kg] as so many beams."""
    bodies, welds = "", ""
    for i in range(parts):
        words = {
            "NUMBER": i,
            "LENGTH": 1000 / parts,
            "WIDE": wide,
            "HIGH": high,
            "ELEMENTS": ELEMENTS // parts,
        }
        part = PART.replace("elements: ELEMENTS", f"elements: {words.pop('ELEMENTS')}")
        for word, value in words.items():
            part = part.replace(word, str(value))
        bodies += part
        child = "load.root" if i == parts - 1 else f"part_{i + 1}.root"
        welds += f"  weld_{i}: {{parent: part_{i}.end, child: {child}}}\n"
    text = ARM.replace("BODIES\n", bodies).replace("WELDS\n", welds).replace("LOAD", str(load))
    (folder / "blade.yaml").write_text(text, encoding="utf-8")
    return load_config(folder / "blade.yaml")


def of_segments(config: ManipulatorConfig) -> Array:
    """Return the frequencies of rigid segments [rad/s], extrapolated from two numbers of them, (MODES,)."""
    found = []
    for n in (16, 32):
        tree = SegmentTree(config, n)
        found.append(tree.locked_frequencies(equilibrium(tree, config.home), MODES))
    return np.asarray((4 * found[1] - found[0]) / 3)


def of_beams(config: ManipulatorConfig) -> tuple[Array, float]:
    """Return the frequencies [rad/s], (MODES,), and the sag [m] of the reduced tree."""
    tree = ReducedTree(config, use_compiler=False)
    q, _ = find_equilibrium(tree, config.home)
    M, _, K, _ = (np.array(part) for part in tree.linearisation(q))
    return locked(M, (K + K.T) / 2, tree.actuated, MODES), -float(tree.tip_pose(q)[2, 3])


@pytest.mark.parametrize(("wide", "high", "load"), [(6, 20, 1.0), (20, 6, 0.1)])
def test_frequencies_of_a_blade_that_sags_come_closer_the_more_beams_it_is(
    tmp_path: Path, wide: float, high: float, load: float
) -> None:
    truth, errors = of_segments(blade(tmp_path, wide, high, load, 1)), []
    for parts in (1, 2, 3):
        found, sag = of_beams(blade(tmp_path, wide, high, load, parts))
        errors.append(abs(found / truth - 1).max())
        told = f"{parts} beams: sags {1e3 * sag:.1f} mm, {100 * errors[-1]:.3f} % off"
        print(f"{wide} x {high} mm, {load} kg, {told}")
    assert errors[0] < 1.2e-3
    assert errors[1] < 0.6 * errors[0] and errors[2] < 0.15 * errors[0]
