"""Modes over poses keep their identity, and nothing is lost from one pose to the next."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from arms import FOLDER, SINGLE_LINK, Array, tree

from flexarm_model.reading.config import load_config
from flexarm_model.served.linearize import PoseError, linearize
from flexarm_model.served.mode_change import mode_change, mode_shapes
from flexarm_model.served.mode_following import alikeness, follow, turn_modes
from flexarm_model.served.model_file import ModelFileError
from flexarm_model.served.pose_grid import PoseGrid, Poses, _outwards, build_grid, grid_poses
from flexarm_model.served.pose_grid_file import INDEX, load_grid, save_grid
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.reduced_tree import ReducedTree

ELBOW = np.linspace(0.0, 3.0, 25)  # frequencies of the modes in and out of the plane cross four times


@pytest.fixture(scope="module")
def crossing(tmp_path_factory: pytest.TempPathFactory) -> ReducedTree:
    """An arm that bends in its plane and, uncoupled, out of it."""
    text = (FOLDER / "planar.yaml").read_text(encoding="utf-8")
    text = text.replace("deformation: [bend_y]", "deformation: [bend_y, bend_z]")
    text = text.replace("along_y: 4 mm, along_z: 30 mm", "along_y: 5 mm, along_z: 4.6 mm")
    text = text.replace("along_y: 3 mm, along_z: 30 mm", "along_y: 4 mm, along_z: 3.9 mm")
    path = tmp_path_factory.mktemp("arm") / "crossing.yaml"
    path.write_text(text, encoding="utf-8")
    return ReducedTree(load_config(path), use_compiler=False)


def path_of(poses: list[list[float]]) -> Poses:
    """Return poses of which each is the neighbour of the next."""
    return Poses(np.array(poses, dtype=float), tuple((i, i + 1) for i in range(len(poses) - 1)))


@cache
def small_grid() -> PoseGrid:
    return build_grid(tree("planar"), grid_poses([[-0.3, 0.0, 0.3], [0.2, 0.6]]))


def test_a_mode_keeps_its_number_where_frequencies_cross(crossing: ReducedTree) -> None:
    grid = build_grid(crossing, path_of([[0.0, elbow] for elbow in ELBOW]))
    rises = [abs(m.outputs.C_pos[m.outputs.names.index("tip.tz"), 2:]) > 1e-6 for m in grid.models]
    assert all((out == rises[0]).all() for out in rises)  # in the plane or out of it, throughout
    order = {tuple(np.argsort(model.omega)) for model in grid.models}
    assert len(order) > 2  # though they do cross
    assert not grid.unclear


def test_tracked_shapes_are_continuous_in_sign(crossing: ReducedTree) -> None:
    grid = build_grid(crossing, path_of([[0.0, elbow] for elbow in ELBOW]))
    for link in grid.links:
        assert np.diag(link.change).min() > 0.9


def test_turned_models_have_the_same_dynamics() -> None:
    arm = tree("spatial")
    model = linearize(arm, np.array([0.1, -0.4, 1.0]))
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(6, 6)))[0]
    turned = turn_modes(model, turn)
    s = 2j * np.pi * 9.0

    def response(m: ReducedModel) -> Array:
        inner = np.linalg.inv(s**2 * m.M + s * m.D + m.K) @ m.B
        out = m.outputs
        return np.asarray((out.C_pos + s * out.C_vel + s**2 * out.C_acc) @ inner)

    assert response(turned) == pytest.approx(response(model), rel=1e-9, abs=1e-12)
    assert turned.f0[:3] == pytest.approx(model.f0[:3])


def test_numbers_and_signs_come_back_after_shuffling() -> None:
    arm = tree("spatial")
    model = linearize(arm)
    shuffle = np.eye(6)[:, [3, 1, 0, 5, 4, 2]] * np.array([1, -1, -1, 1, 1, -1])
    again = follow(arm, model, turn_modes(model, shuffle))
    assert again.omega == pytest.approx(model.omega, rel=1e-9)
    assert again.Phi == pytest.approx(model.Phi, abs=1e-9)


def test_turning_the_base_of_an_arm_without_gravity_changes_nothing() -> None:
    arm = tree("planar")
    a, b = (linearize(arm, np.array([shoulder, 0.7])) for shoulder in (-0.5, 1.2))
    assert abs(mode_change(arm, a, b)) == pytest.approx(np.eye(4), abs=1e-6)
    assert alikeness(arm, a, b) == pytest.approx(np.eye(4), abs=1e-6)


def test_with_all_modes_the_change_of_coordinates_loses_nothing() -> None:
    arm = tree("spatial")
    a, b = (linearize(arm, np.array([0.0, -0.5, elbow]), arm.n_q - 3) for elbow in (0.5, 1.0))
    change = mode_change(arm, a, b)
    assert mode_shapes(b) @ change == pytest.approx(mode_shapes(a), abs=1e-9 * abs(mode_shapes(a)).max())
    assert mode_change(arm, b, a) @ change == pytest.approx(np.eye(arm.n_q - 3), abs=1e-8)


def test_a_loop_is_followed_as_well() -> None:
    arm = tree("five_bar")
    poses = [np.deg2rad([130 + k, 50 + k]) for k in range(0, 21, 2)]
    grid = build_grid(arm, path_of(poses))
    assert len(grid.models) == len(poses) and not grid.unclear
    changes = [link.change for link in grid.links]
    assert all(abs(np.diag(change) - 1.0).max() < 0.1 for change in changes)


def test_double_modes_of_the_symmetric_pose_are_turned_onto_those_beside_it() -> None:
    config = load_config(SINGLE_LINK.with_name("planar_3rrr.yaml"))
    arm = ReducedTree(config, use_compiler=False)
    path = [config.home + (config.poses["A"] - config.home) * share for share in np.linspace(0.0, 1.0, 12)]
    path += [config.home + (config.poses["B"] - config.home) * share for share in np.linspace(0.1, 1.0, 11)]
    order = np.argsort([pose[0] for pose in path])
    double = build_grid(arm, path_of([config.home])).models[0].omega
    assert double[0] == pytest.approx(double[1], rel=1e-6)
    grid = build_grid(arm, path_of([path[i] for i in order]))
    assert not grid.unclear and len(grid.links) == len(path) - 1
    assert min(link.mac.min() for link in grid.links) > 0.95


def test_a_grid_links_every_pose_with_those_one_step_away() -> None:
    poses = grid_poses([[0.0, 1.0, 2.0], [0.0, 1.0], [0.0, 1.0]])
    near = {
        (i, j)
        for i, a in enumerate(poses.values)
        for j, b in enumerate(poses.values)
        if i < j and np.abs(a - b).sum() == 1.0
    }
    assert set(poses.neighbours) == near and len(poses.neighbours) == len(near)


@pytest.mark.parametrize("values", [[], [0.1, 0.1], [0.0, 0.3, 0.2]])
def test_values_of_an_axis_that_have_no_neighbours_are_refused(values: list[float]) -> None:
    with pytest.raises(ValueError, match=r"axis 2: \[.*\]: expected values that ascend or descend"):
        grid_poses([[0.0, 0.1], values])


def test_a_pose_without_a_model_leaves_a_hole_that_says_why() -> None:
    grid = build_grid(tree("single_link"), grid_poses([[0.0, 0.1, 9.0]]))
    assert [model.pose[0] for model in grid.models] == [0.0, 0.1]
    [(pose, why)] = grid.refused
    assert pose == (9.0,) and "base.rz = 9 rad" in why
    with pytest.raises(PoseError, match="no pose of the grid"):
        build_grid(tree("single_link"), grid_poses([[9.0]]))


def test_the_models_of_a_grid_are_found_by_their_pose() -> None:
    assert small_grid().at(np.array([0.0, 0.6])).pose.tolist() == [0.0, 0.6]
    with pytest.raises(KeyError, match=r"nearest is \[0.0, 0.6\]"):
        small_grid().at(np.array([0.0, 0.7]))


def test_a_grid_comes_back_from_its_folder(tmp_path: Path) -> None:
    save_grid(small_grid(), str(tmp_path / "grid"))
    again = load_grid(str(tmp_path / "grid"))
    assert [m.model_id for m in again.models] == [m.model_id for m in small_grid().models]
    for a, b in zip(again.links, small_grid().links, strict=True):
        assert (a.old, a.new) == (b.old, b.new)
        assert np.array_equal(a.change, b.change) and np.array_equal(a.mac, b.mac)
    with pytest.raises(ModelFileError, match="is not empty"):
        save_grid(small_grid(), tmp_path / "grid")


def test_a_changed_index_or_a_swapped_model_is_refused(tmp_path: Path) -> None:
    folder = tmp_path / "grid"
    save_grid(small_grid(), folder)
    first, second = (folder / f"{model.model_id}.json" for model in small_grid().models[:2])
    content = first.read_bytes()
    first.write_bytes(second.read_bytes())
    with pytest.raises(ModelFileError, match="not the one listed"):
        load_grid(folder)
    first.write_bytes(content)
    index = folder / INDEX
    changed = json.loads(index.read_text())
    changed["links"][0]["old"] = 1
    index.write_text(json.dumps(changed))
    with pytest.raises(ModelFileError, match="was changed"):
        load_grid(folder)
    index.write_text(json.dumps(changed)[:-20])
    with pytest.raises(ModelFileError, match="damaged or cut"):
        load_grid(folder)
    index.unlink()
    with pytest.raises(ModelFileError, match="cannot be read"):
        load_grid(folder)


def test_models_of_different_numbers_of_modes_cannot_be_followed() -> None:
    arm = tree("planar")
    with pytest.raises(ValueError, match="same modes"):
        follow(arm, linearize(arm, modes=3), linearize(arm))


def test_links_number_the_models_that_there_are_not_the_poses_asked_for() -> None:
    grid = build_grid(tree("planar"), path_of([[np.nan, 0.2], [0.0, 0.2], [0.3, 0.2]]))
    assert len(grid.refused) == 1 and len(grid.models) == 2
    assert [(link.old, link.new) for link in grid.links] == [(0, 1)]


def test_modes_are_followed_over_the_clearest_links() -> None:
    """A round trip has one unclear link, which nobody needs."""
    clear = {(0, 1): 0.99, (1, 2): 0.95, (2, 3): 0.9, (0, 3): 0.2}
    assert _outwards([0, 1, 2, 3], clear) == [(0, 1), (1, 2), (2, 3)]
