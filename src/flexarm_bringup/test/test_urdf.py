"""The URDF stands where our own kinematics stands, however the arm is moved and bent.

Pinocchio reads the URDF and moves it; the drawn mechanism and the tree's own function of the tip are ours.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from functools import cache
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from flexarm_bringup.display.segment_graph import SegmentGraph
from flexarm_bringup.display.shape import coordinates
from flexarm_bringup.display.urdf import roll_pitch_yaw, urdf
from flexarm_bringup.model_view.mechanism_lines import MechanismLines, node_transform
from flexarm_model.numeric.rotation import rotation_from_rpy
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

ARMS = Path(__file__).parents[2] / "flexarm_model/test/arms"
DOCS = Path(__file__).parents[3] / "docs"
FIVE = ["single_link", "planar_3rrr", "spatial_3tpt", "variable_stiffness", "serial_6r"]
STATIONS = 2  # Pinocchio needs minutes for hundreds of joints
TOLERANCE = 1e-9  # m and 1
BENDING = 0.05  # of the elastic coordinates; the tips of beams turn by some degrees


@cache
def tree(name: str) -> ReducedTree:
    return ReducedTree(load_config(find_manipulator(name)), use_compiler=False)


@cache
def shown(name: str) -> tuple[SegmentGraph, pin.Model]:
    graph = SegmentGraph(tree(name), STATIONS)
    return graph, pin.buildModelFromXML(urdf(tree(name).config, graph))


def placed(name: str, q: np.ndarray) -> dict[str, np.ndarray]:
    """Return the pose of every link, as Pinocchio has it, (4, 4)."""
    graph, model = shown(name)
    data, at = model.createData(), pin.neutral(model)
    for joint, value in graph.values(q).items():
        at[model.joints[model.getJointId(joint)].idx_q] = value
    pin.framesForwardKinematics(model, data, at)
    return {frame.name: data.oMf[i].homogeneous for i, frame in enumerate(model.frames)}


def scattered(name: str, seed: int) -> np.ndarray:
    """Return random coordinates: axes anywhere, bodies bent; loops are open."""
    arm, rng = tree(name), np.random.default_rng(seed)
    is_axis = np.arange(arm.n_q) < len(arm.axis_names)
    return rng.uniform(-1.0, 1.0, arm.n_q) * np.where(is_axis, 1.0, BENDING)


@pytest.mark.parametrize("name", FIVE)
def test_every_node_of_every_body_is_a_link_in_its_place_at_random_coordinates(name: str) -> None:
    arm = tree(name)
    for seed in range(3):
        q = scattered(name, seed)
        links, frames = placed(name, q), MechanismLines(arm, 2).frames(q)
        for body, shapes in arm.bodies.items():
            eta = q[arm.elastic_coordinates(body).start : arm.elastic_coordinates(body).stop]
            for node, shape in shapes.nodes.items():
                ours = frames[body] @ node_transform(shape, eta)
                assert links[f"{body}.{node}"] == pytest.approx(ours, abs=TOLERANCE), f"{body}.{node}"


def test_nodes_that_are_named_like_stations_keep_their_places(tmp_path: Path) -> None:
    text = (DOCS / "two_link.yaml").read_text()
    text = text.replace("gauge: 10 mm, end: 400 mm", "s1: 10 mm, s2: 400 mm")
    file = tmp_path / "named_like_stations.yaml"
    file.write_text(text.replace("upper.end", "upper.s2").replace("upper.gauge", "upper.s1"))
    name = str(file)
    q, arm = scattered(name, 1), tree(name)
    assert placed(name, q)["tool"] == pytest.approx(arm.tip_pose(q), abs=TOLERANCE)
    at_rest = placed(name, np.zeros(arm.n_q))
    assert at_rest["upper.s1"][0, 3] == pytest.approx(0.010, abs=TOLERANCE)
    assert at_rest["upper.s2"][0, 3] == pytest.approx(0.400, abs=TOLERANCE)


@pytest.mark.parametrize("name", FIVE)
def test_the_tool_is_at_the_tip_of_the_dynamics_where_the_loops_close(name: str) -> None:
    arm, rng = tree(name), np.random.default_rng(1)
    for _ in range(3):
        is_axis = np.arange(arm.n_q) < len(arm.axis_names)
        q = arm.closed(arm.loops.home + rng.normal(size=arm.n_q) * np.where(is_axis, 1e-2, 1e-3))
        assert placed(name, q)["tool"] == pytest.approx(arm.tip_pose(q), abs=TOLERANCE)


@pytest.mark.parametrize("name", FIVE[1:3])
def test_both_ends_of_a_cut_loop_meet_where_the_loops_close(name: str) -> None:
    arm = tree(name)
    q = arm.closed(arm.loops.home)
    links = placed(name, q)
    for joint in arm.config.closures:
        free = {axis.name for axis in joint.axes}
        ends = (links[str(joint.parent)] @ joint.placement)[:3, 3], links[str(joint.child)][:3, 3]
        if not {"tx", "ty", "tz"} & free:
            assert ends[0] == pytest.approx(ends[1], abs=TOLERANCE), joint.name


@pytest.mark.parametrize("name", FIVE)
def test_axes_keep_their_names_and_limits_and_links_form_one_tree(name: str) -> None:
    graph, model = shown(name)
    config, robot = tree(name).config, ElementTree.fromstring(urdf(tree(name).config, graph))
    limits = {item.get("name"): item.find("limit") for item in robot.iter("joint")}
    for axis, spec in config.actuated.items():
        if np.isfinite(spec.effort):
            assert float(limits[axis].get("effort")) == spec.effort
        if np.isfinite(spec.lower):
            assert (float(limits[axis].get("lower")), float(limits[axis].get("upper"))) == (
                spec.lower,
                spec.upper,
            )
    links = [item.get("name") for item in robot.iter("link") if item.get("name")]
    children = [item.find("child").get("link") for item in robot.iter("joint")]
    assert len(set(links)) == len(links) and sorted(children) == sorted(set(links) - {"base"})
    assert model.nq == len(graph.moving)


def test_a_bent_strip_has_segment_joints_and_a_rigid_hub_has_none() -> None:
    graph, _ = shown("single_link")
    assert "base.rz" in graph.moving
    assert {name.split(".")[0] for name in graph.moving} == {"base", "strip"}
    assert {name.rpartition(".")[2] for name in graph.moving if name.startswith("strip")} == {
        "tx",
        "ty",
        "rz",
    }


@pytest.mark.parametrize("name", FIVE)
def test_what_is_drawn_is_no_larger_than_the_arm(name: str) -> None:
    """The rigid ends of the strips of the 3RRR, which have no section, were boxes of 3.5 m."""
    drawn = ElementTree.fromstring(urdf(tree(name).config, shown(name)[0])).iter("geometry")
    shapes = [shape for each in drawn for shape in each]
    sizes = [float(value) for shape in shapes for text in shape.attrib.values() for value in text.split()]
    lines = MechanismLines(tree(name)).lines(np.zeros(tree(name).n_q))
    size = np.ptp(np.concatenate([line.points for line in lines]), axis=0).max()
    assert sizes and min(sizes) > 0.0 and max(sizes) <= size


def test_a_piece_of_a_beam_is_drawn_with_its_own_section() -> None:
    name = "planar_3rrr"
    robot = ElementTree.fromstring(urdf(tree(name).config, shown(name)[0]))
    sections = {tuple(map(float, box.get("size").split()[1:])) for box in robot.iter("box")}
    assert [pytest.approx(section) for section in sections] == [(0.0007, 0.035)]
    assert robot.findall("link[@name='first_1.root']/visual/geometry/cylinder")


def test_an_estimate_bends_the_arm_as_the_outputs_of_its_model_say() -> None:
    model = linearize(tree("single_link"))
    row = model.outputs.names.index("tip.ty")
    theta, eta = np.array([0.0]), np.array([1e-6, -2e-6, 1e-6])
    rest = placed("single_link", coordinates(model, theta, 0 * eta))["tool"][1, 3]
    for magnification in (1.0, 50.0):
        q = coordinates(model, theta, eta, magnification)
        moved = placed("single_link", q)["tool"][1, 3] - rest
        linear = magnification * model.outputs.C_pos[row, 1:] @ eta
        assert moved == pytest.approx(linear, rel=1e-3)  # what is left is of second order


@pytest.mark.parametrize("pitch", [0.3, np.pi / 2, -np.pi / 2, np.pi])
def test_roll_pitch_yaw_give_the_rotation_back_also_where_they_are_not_unique(pitch: float) -> None:
    R = rotation_from_rpy(np.array([0.4, pitch, -1.1]))
    assert rotation_from_rpy(np.array(roll_pitch_yaw(R))) == pytest.approx(R, abs=1e-12)
