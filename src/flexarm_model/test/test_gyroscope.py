"""Gyroscopes: the angular velocity of a node in its own axes, on rigid, flexible and described arms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from arms import Array, arm, random_states
from scipy.spatial.transform import Rotation

from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.manipulator.sensor_spec import SensorSpec
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.segments.segment_tree import SegmentTree
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree
from flexarm_model.tree.sensors import output_units


def with_gyroscope(config: ManipulatorConfig) -> ManipulatorConfig:
    """Return the arm with nothing but a gyroscope, at its tip."""
    gyroscope = SensorSpec("rate", "gyroscope", str(config.tip), ("x", "y", "z"), np.full(3, 1e-3))
    return replace(config, sensors=(gyroscope,))


def told(tree: ReducedTree, q: Array, v: Array) -> Array:
    return np.array(tree.functions["outputs"](q, v, 0 * v, q))[:3]


def test_a_rigid_arm_turns_as_pinocchio_says() -> None:
    config = with_gyroscope(arm("spatial_rigid"))
    ours, theirs = ReducedTree(config, use_compiler=False), SegmentTree(config, 1)
    for q, v, _ in random_states(ours, 50):
        assert told(ours, q, v) == pytest.approx(theirs.node_rate(q, v, config.tip), rel=1e-10, abs=1e-11)


@pytest.mark.parametrize("name", ["single_link", "planar", "spatial"])
def test_it_is_how_fast_the_axes_of_the_tip_turn(name: str) -> None:
    tree, h = ReducedTree(with_gyroscope(arm(name)), use_compiler=False), 1e-5
    for q, v, _ in random_states(tree, 10):
        before, after = (tree.tip_pose(q + side * h * v)[:3, :3] for side in (-1, 1))
        turn = Rotation.from_matrix(before.T @ after).as_rotvec() / (2 * h)  # in axes half a turn behind
        half = Rotation.from_rotvec(h * turn).as_matrix().T @ turn
        assert told(tree, q, v) == pytest.approx(half, rel=1e-6, abs=1e-6 * abs(v).max())


@pytest.mark.parametrize("name", ["single_link", "planar_3rrr", "serial_6r"])
def test_the_served_rows_are_of_velocities_alone(name: str) -> None:
    """At rest nothing turns, whatever the pose; a row times the rates of all coordinates is the rate."""
    config = with_gyroscope(load_config(find_manipulator(name)))
    model = linearize(ReducedTree(config, use_compiler=False))
    rows = model.outputs.rows("rate")
    assert abs(model.outputs.C_vel[rows]).max() > 0.1
    assert not model.outputs.C_pos[rows].any() and not model.outputs.C_acc[rows].any()
    assert not model.outputs.y0[rows].any()
    assert set(output_units(config)[:3]) == {"rad/s"}


def test_the_gyroscope_of_a_strip_tells_hub_and_slope() -> None:
    """In the plane the rate is that of the hub and of the slope of the modes, to the last digit."""
    tree = ReducedTree(with_gyroscope(load_config(find_manipulator("single_link"))), use_compiler=False)
    model = linearize(tree)
    turn = model.outputs.C_vel[model.outputs.names.index("rate.z")]
    slope = model.outputs.C_pos[model.outputs.names.index("tip.rz")]
    assert turn == pytest.approx(slope, rel=1e-9, abs=1e-9)
    assert turn[0] == pytest.approx(1.0, abs=1e-12)
