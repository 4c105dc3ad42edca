"""An imported body in the reduced tree: a rigid body when it does not deform, a beam when it is slender."""

from __future__ import annotations

import copy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from arms import scales
from fe_bodies import block, bracket, description, load_arm, write_arm
from finite_difference import finite_difference
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from flexarm_model.bodies.body_reduction import reduce_body
from flexarm_model.bodies.sid_file import write_sid
from flexarm_model.manipulator.body_spec import RigidBody
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.segments.segment_tree import SegmentTree
from flexarm_model.served.linearize import linearize
from flexarm_model.settings.strict_yaml import ConfigError
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]


@pytest.fixture(scope="module")
def config(tmp_path_factory: pytest.TempPathFactory) -> ManipulatorConfig:
    return load_arm(tmp_path_factory.mktemp("arm"), bracket())


@pytest.fixture(scope="module")
def tree(config: ManipulatorConfig) -> ReducedTree:
    return ReducedTree(config, use_compiler=False)


def as_rigid(config: ManipulatorConfig) -> ManipulatorConfig:
    """Return the arm with the solid replaced by a rigid body of its mass, centre and inertia."""
    solid = reduce_body(config.bodies["solid"], {"root", "end"})
    com, second = solid.s[0] / solid.mass, solid.P[0, 0]
    about = second - solid.mass * np.outer(com, com)
    nodes = {name: node.r for name, node in solid.nodes.items()}
    rigid = RigidBody("solid", solid.mass, com, np.trace(about) * np.eye(3) - about, nodes)
    return replace(config, bodies={**config.bodies, "solid": rigid})


def test_a_body_that_does_not_deform_moves_as_pinocchios_rigid_one(
    config: ManipulatorConfig, tree: ReducedTree
) -> None:
    oracle = SegmentTree(as_rigid(config), 1)
    rng = np.random.default_rng(6)
    for _ in range(50):
        q, v, a = np.zeros((3, tree.n_q))
        q[:2], v[:2], a[:2] = rng.uniform(-2, 2, (3, 2))
        expected = oracle.inverse_dynamics(q[:2], v[:2], a[:2])
        assert tree.functions["inverse_dynamics"](q, v, a)[:2] == pytest.approx(
            expected, rel=1e-10, abs=1e-10
        )
        M = np.array(tree.functions["mass_matrix"](q))[:2, :2]
        assert pytest.approx(oracle.mass_matrix(q[:2]), rel=1e-10) == M
        assert tree.tip_pose(q) == pytest.approx(oracle.tip_pose(q[:2]), abs=1e-12)


def test_the_mass_matrix_is_symmetric_and_positive(tree: ReducedTree) -> None:
    scale = scales(tree)
    for x in np.random.default_rng(7).uniform(-1, 1, (20, tree.n_q)):
        M = np.array(tree.functions["mass_matrix"](x * scale))
        assert abs(M - M.T).max() < 1e-12 * abs(M).max() and np.linalg.eigvalsh(M).min() > 0


def test_coriolis_forces_do_no_work(tree: ReducedTree) -> None:
    f, scale = tree.functions, scales(tree)

    def mass_along(t: Array, q: Array, v: Array) -> Array:
        return np.array(f["mass_matrix"](q + t * v))

    for q, v in np.random.default_rng(8).uniform(-1, 1, (10, 2, tree.n_q)) * scale:
        h, g = np.array(f["bias"](q, v)), np.array(f["bias"](q, 0 * v))
        M_dot = finite_difference(lambda t, q=q, v=v: mass_along(t, q, v), np.zeros(1))[..., 0]
        power = v @ M_dot @ v / 2 + v @ g
        assert v @ h == pytest.approx(power, rel=1e-8, abs=1e-8 * np.linalg.norm(v) * np.linalg.norm(h))


def test_free_motion_keeps_its_energy(tmp_path: Path) -> None:
    config = load_arm(tmp_path, block(6), reduction={"method": "craig_bampton", "modes": 3})
    arm = ReducedTree(config, use_compiler=False)
    f, n = arm.functions, arm.n_q

    def rate(_: float, x: Array) -> Array:
        q, v = x[:n], x[n : 2 * n]
        return np.concatenate([v, f["forward_dynamics"](q, v, 0 * v), [v @ np.array(f["bias"](q, 0 * v))]])

    def energy(x: Array) -> float:
        v = x[n : 2 * n]
        return float(v @ np.array(f["mass_matrix"](x[:n])) @ v / 2 + x[-1])

    start = np.zeros(2 * n + 1)
    start[n : n + 2], start[n + 2 : 2 * n] = 4.0, 0.1
    end = solve_ivp(rate, (0, 0.1), start, method="DOP853", rtol=1e-10, atol=1e-13).y[:, -1]
    assert abs(end[:2]).max() > 0.3 and abs(end[2:n]).max() > 1e-5
    assert energy(end) == pytest.approx(energy(start), rel=1e-6)


def beam_arm(folder: Path) -> ManipulatorConfig:
    """Return the arm with a beam in place of the slender block."""
    content = copy.deepcopy(description())
    content["bodies"]["solid"] = {
        "type": "beam",
        "pieces": [
            {
                "length": "400 mm",
                "section": {"shape": "rectangle", "along_y": "20 mm", "along_z": "16 mm"},
                "youngs_modulus": "70 GPa",
                "shear_modulus": "35 GPa",
                "density": "2700 kg/m^3",
                "elements": 8,
            }
        ],
        "deformation": ["bend_y", "bend_z", "torsion"],
        "damping_ratio": 0,
        "nodes": {"end": "400 mm"},
        "reduction": {"method": "craig_bampton", "modes": 9, "frame": "clamped"},
    }
    path = folder / "beam.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return load_config(path)


@pytest.mark.slow
def test_a_slender_block_arm_rings_like_a_beam_arm(tmp_path: Path) -> None:
    from_files = ReducedTree(load_arm(tmp_path, block(20, nu=0.0)), use_compiler=False)
    from_beam = ReducedTree(beam_arm(tmp_path), use_compiler=False)
    pose = np.radians([20.0, -35.0])
    found, expected = linearize(from_files, pose), linearize(from_beam, pose)
    assert found.omega[:2] == pytest.approx(expected.omega[:2], rel=5e-3)  # shear, which beams leave out
    assert found.omega[2] == pytest.approx(expected.omega[2], rel=3e-2)  # two bricks warp less than a section
    assert found.f0[:2] == pytest.approx(expected.f0[:2], rel=1e-4)


def test_the_segment_tree_says_that_it_has_no_segments_for_it(config: ManipulatorConfig) -> None:
    with pytest.raises(ValueError, match="body 'solid': an imported body has no segments"):
        SegmentTree(config, 4)


def test_an_accelerometer_and_the_tip_move_with_the_interface(tmp_path: Path) -> None:
    path = write_arm(tmp_path, block(6))
    content = yaml.safe_load(path.read_text(encoding="utf-8"))
    sensor = {
        "kind": "accelerometer",
        "node": "solid.end",
        "axes": ["x", "y", "z"],
        "sigma": "0.01 m/s^2",
        "range": "10 g",
    }
    path.write_text(yaml.safe_dump({**content, "sensors": {"imu": sensor}}), encoding="utf-8")
    model = linearize(ReducedTree(load_config(path), use_compiler=False))
    assert np.linalg.norm(model.outputs.y0[:3]) == pytest.approx(9.81, rel=1e-3)  # the sag tilts it a little
    assert abs(model.outputs.C_acc[:3, 2:]).max() > 0.1


def test_a_superelement_from_a_file_moves_as_the_body_it_was_made_of(tmp_path: Path) -> None:
    config = load_arm(tmp_path, bracket())
    tree = ReducedTree(config, use_compiler=False)
    write_sid(tree.bodies["solid"], tmp_path / "solid.sid")
    content = yaml.safe_load((tmp_path / "arm.yaml").read_text(encoding="utf-8"))
    content["bodies"]["solid"] = {"type": "superelement", "file": "solid.sid"}
    path = tmp_path / "from_sid.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    other = load_config(path)
    again = ReducedTree(other, use_compiler=False)
    for q, v, a in np.random.default_rng(10).uniform(-1, 1, (5, 3, tree.n_q)) * scales(tree):
        expected = np.array(tree.functions["inverse_dynamics"](q, v, a))
        assert np.array_equal(again.functions["inverse_dynamics"](q, v, a), expected)
    (tmp_path / "solid.sid").write_text("part\nend part\n", encoding="utf-8")
    with pytest.raises(
        ConfigError, match=r"bodies.solid.file: 'solid.sid': .*solid.sid: line 1: part: block 'modal'"
    ):
        load_config(path)
