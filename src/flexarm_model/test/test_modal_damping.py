"""A damping ratio said of bodies and springs becomes the ratio of the arm's modes."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import yaml
from arms import SINGLE_LINK, arm
from scipy.linalg import eigh

from flexarm_model.manipulator.body_spec import Beam
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.manipulator.start_pose import starting_at
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.segments.segment_tree import SegmentTree
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.modal_damping import Losses, modal_damping
from flexarm_model.tree.reduced_tree import ReducedTree

ARMS = ("planar", "spatial")


def with_ratios(name: str, ratios: list[float]) -> ManipulatorConfig:
    """Return a test arm without other damping whose beams have these ratios."""
    config = arm(name)
    beams = [body for body in config.bodies.values() if isinstance(body, Beam)]
    bodies = {
        body.name: replace(body, damping_ratio=ratio) for body, ratio in zip(beams, ratios, strict=False)
    }
    joints = tuple(
        replace(joint, axes=tuple(replace(axis, damping=0.0) for axis in joint.axes))
        for joint in config.joints
    )
    return replace(config, bodies={**config.bodies, **bodies}, joints=joints, gravity=np.zeros(3))


@pytest.mark.parametrize("name", ARMS)
def test_bodies_of_one_ratio_give_every_mode_that_ratio(name: str) -> None:
    model = linearize(ReducedTree(with_ratios(name, [0.02] * 9), use_compiler=False))
    assert model.zeta == pytest.approx(np.full(model.zeta.size, 0.02), rel=1e-3)


@pytest.mark.parametrize("name", ARMS)
def test_the_segment_tree_damps_its_modes_alike(name: str) -> None:
    config = with_ratios(name, [0.02] * 9)
    tree = SegmentTree(config, 4)
    q = tree.close(config.home)
    e = np.setdiff1d(np.arange(tree.n_q), tree.actuated)
    value, Phi = eigh(tree.K[np.ix_(e, e)], tree.mass_matrix(q)[np.ix_(e, e)])
    zeta = np.einsum("ik,ij,jk->k", Phi, tree.D[np.ix_(e, e)], Phi) / (2 * np.sqrt(value))
    assert zeta == pytest.approx(np.full(zeta.size, 0.02), rel=1e-6)


def test_a_mode_takes_after_the_body_that_it_strains() -> None:
    tree = ReducedTree(with_ratios("planar", [0.01, 0.05]), use_compiler=False)
    model = linearize(tree)
    e = range(len(tree.axes), tree.n_q)
    for k, zeta in enumerate(model.zeta):
        phi = model.Phi[:, len(model.theta_names) + k]
        strain = np.array([tree.K[i, i] * phi[i] ** 2 for i in e])
        ratio = np.array([tree.bodies[tree.coordinates[i].split(".")[0]].damping_ratio for i in e])
        assert zeta == pytest.approx(float(strain @ ratio / strain.sum()), rel=1e-2)
        assert 0.01 < zeta < 0.05


def test_what_strains_nothing_is_not_damped() -> None:
    model = linearize(ReducedTree(with_ratios("planar", [0.02] * 9), use_compiler=False))
    n = len(model.theta_names)
    assert abs(model.D[:n, :n]).max() < 1e-9 * abs(model.M[:n, :n]).max()


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("stiff", [1e6, 1e12, 1e15])
def test_slow_modes_keep_their_ratios_beside_one_that_is_very_fast(stiff: float, turned: bool) -> None:
    """Springs on unit masses have 2 zeta omega each; slow ones lost theirs beside one 1e6 times as fast."""
    k, zeta = np.array([1.0, 4.0, 0.0, stiff]), np.array([0.01, 0.05, 0.0, 0.02])
    Q = np.linalg.qr(np.random.default_rng(3).standard_normal((4, 4)))[0] if turned else np.eye(4)
    losses = Losses(np.diag(zeta * k), np.zeros((4, 4)))
    D = modal_damping(np.eye(4), np.diag(k), losses, Q, list("abcd"))
    assert np.diag(D) == pytest.approx(2 * zeta * np.sqrt(k), rel=1e-7)
    assert abs(D - np.diag(np.diag(D)))[:3, :3].max() < 1e-6


def test_a_pendulum_with_a_stiff_axis_at_its_end_has_the_ratio_of_its_spring(tmp_path: Path) -> None:
    content = yaml.safe_load(SINGLE_LINK.read_text(encoding="utf-8"))
    content["bodies"] = {
        "hub": {"type": "rigid", "mass": "1 kg", "inertia": ["1 kg m^2"] * 3 + ["0 kg m^2"] * 3},
        "arm": {"type": "rigid", "mass": "1 kg", "nodes": {"end": ["1 m", "0 m", "0 m"]}},
        "ball": {"type": "rigid", "mass": "1 g"},
    }
    base = {"actuated": True, "effort": "1 N m", "rotor_inertia": "0.1 kg m^2"}
    content["joints"] = {
        "base": {"parent": "world", "child": "hub.root", "axes": {"rz": base}},
        "hinge": {"parent": "hub.root", "child": "arm.root",
                  "axes": {"rz": {"stiffness": "1 N m/rad", "damping_ratio": 0.02}}},
        "slide": {"parent": "arm.end", "child": "ball.root",
                  "axes": {"tx": {"stiffness": "1e12 N/m", "damping_ratio": 0.03}}},
    }  # fmt: skip
    content["sensors"] = {"encoder": {"kind": "encoder", "axis": "base.rz", "sigma": "20 urad"}}
    content["served"] = {"modes": 2, "home": ["0 deg"], "rate": "200 Hz"}
    content |= {"tip": "arm.end", "gravity": ["0 m/s^2"] * 3}
    for key in ("presets", "parameters"):
        content.pop(key, None)
    (path := tmp_path / "arm.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    model = linearize(ReducedTree(load_config(path), use_compiler=False))
    assert model.omega[1] > 0.99e6 * model.omega[0]
    assert model.zeta == pytest.approx([0.02, 0.03], rel=1e-6)


def test_ratios_hold_at_the_described_home_wherever_the_arm_starts() -> None:
    """A node that is told where the arm starts has the same arm as one that is not."""
    config = load_config(find_manipulator("planar_3rrr"))
    elsewhere = starting_at(starting_at(config, config.home + [-0.2, 0.1, 0.2]), config.home - 0.1)
    for tree in (ReducedTree, partial(SegmentTree, n_segments=2)):
        D = tree(config).D
        np.testing.assert_allclose(tree(elsewhere).D, D, rtol=0, atol=1e-9 * abs(D).max())
        moved = replace(config, home=elsewhere.home)
        assert abs(tree(moved).D - D).max() > 1e-3 * abs(D).max()


BLADE = """
format: flexarm/1
name: blade
source: made up for a test
gravity: [0 m/s^2, 0 m/s^2, 0 m/s^2]
bodies:
  blade:
    type: beam
    pieces:
      - length: 1 m
        section: {shape: rectangle, along_y: 4 mm, along_z: 40 mm}
        youngs_modulus: 70 GPa
        density: 2700 kg/m^3
        elements: 20
    point_masses: [{name: load, at: 1 m, mass: 1 kg}]
    deformation: [bend_y]
    damping_ratio: 1 %
    nodes: {end: 1 m}
    reduction: {method: craig_bampton, modes: 6, frame: clamped}
joints:
  base: {parent: world, child: blade.root, axes: {rz: {actuated: true, rotor_inertia: 1 kg m^2}}}
tip: blade.end
served: {modes: 2, home: [0 deg], rate: 200 Hz}
"""


@pytest.mark.parametrize(("stands", "along_x"), [("lies", 0.0), ("stands", -9.81), ("hangs", 9.81)])
def test_weight_changes_frequencies_and_leaves_the_rates_of_damping(
    tmp_path: Path, stands: str, along_x: float
) -> None:
    (tmp_path / "blade.yaml").write_text(BLADE, encoding="utf-8")
    lying = load_config(tmp_path / "blade.yaml")
    config = replace(lying, gravity=np.array([along_x, 0.0, 0.0]))
    free, model = (linearize(ReducedTree(arm, use_compiler=False)) for arm in (lying, config))
    print(f"{stands}: {model.omega[0] / (2 * np.pi):.3f} Hz, {100 * model.zeta[0]:.2f} %")
    assert free.zeta == pytest.approx(0.01, rel=1e-9)
    assert model.zeta * model.omega == pytest.approx(free.zeta * free.omega, rel=1e-3)
    expected = {"lies": 1.0, "stands": 1.19, "hangs": 0.88}[stands]
    assert 100 * model.zeta[0] == pytest.approx(expected, abs=0.005)
