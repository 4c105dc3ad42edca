"""A stage on two leaf springs that are clamped at both ends: a loop that only bending lets move."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flexarm_model.reading.config import load_config
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.closure_error import ClosureError
from flexarm_model.tree.reduced_tree import ReducedTree

LENGTH, THICK, WIDE, E, DENSITY, STAGE = 0.2, 0.001, 0.02, 200e9, 7800.0, 1.0  # SI
ARM = """
format: flexarm/1
name: stage
source: made up for a test
gravity: [0 m/s^2, 0 m/s^2, 0 m/s^2]
bodies:
  base: &rigid
    type: rigid
    mass: 1 kg
    inertia: [0.1 kg m^2, 0.1 kg m^2, 0.1 kg m^2, 0 kg m^2, 0 kg m^2, 0 kg m^2]
    nodes: {beside: [0 mm, 100 mm, 0 mm]}
  left: &leaf
    type: beam
    pieces:
      - {length: 200 mm, section: {shape: rectangle, along_y: 1 mm, along_z: 20 mm}, youngs_modulus: 200 GPa,
         density: 7800 kg/m^3, elements: 8}
    deformation: [bend_y]
    damping_ratio: 1 %
    nodes: {end: 200 mm}
    reduction: {method: craig_bampton, modes: 4, frame: clamped}
  right: *leaf
  stage: *rigid
joints:
  rail: {parent: world, child: base.root, axes: {ty: {actuated: true, rotor_inertia: 1 kg, effort: 100 N}}}
  left_root: {parent: base.root, child: left.root}
  right_root: {parent: base.beside, child: right.root}
  left_end: {parent: left.end, child: stage.root}
  right_end: {parent: right.end, child: stage.beside, axes: {AXES}}
sensors:
  encoder: {kind: encoder, axis: rail.ty, sigma: 10 um}
tip: stage.root
served: {modes: 1, home: [0 mm], rate: 500 Hz}
"""
SPRINGS = "{tx: {stiffness: 1e7 N/m}, ty: {stiffness: 1e7 N/m}, rz: {stiffness: 1e7 N m/rad}}"


def stage(folder: Path, axes: str) -> ReducedTree:
    path = folder / "stage.yaml"
    path.write_text(ARM.replace("{AXES}", axes), encoding="utf-8")
    return ReducedTree(load_config(path), use_compiler=False)


def test_stiff_springs_in_place_of_the_last_weld_give_the_frequency_of_guided_leaves(tmp_path: Path) -> None:
    k = 2 * 12 * E * WIDE * THICK**3 / 12 / LENGTH**3
    leaves = 2 * DENSITY * WIDE * THICK * LENGTH * 13 / 35  # their part of the stage's mass, bent statically
    omega = linearize(stage(tmp_path, SPRINGS)).omega[0]
    assert omega == pytest.approx(np.sqrt(k / (STAGE + leaves)), rel=1e-3)


def test_a_loop_of_leaves_and_welds_is_told_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(ClosureError, match=r"what bends closes no loop.* a weld stiff springs, such as tx"):
        stage(tmp_path, "{}")
