"""The markers node shows a bent arm where the estimate has it, and a URDF that moves with it."""

from __future__ import annotations

import math
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

rclpy = pytest.importorskip("rclpy", reason="needs ROS")
pytestmark = pytest.mark.ros

from flexarm_interfaces.msg import ModalState, ReducedModel  # noqa: E402
from rclpy.serialization import serialize_message  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402
from std_msgs.msg import String  # noqa: E402
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint  # noqa: E402
from visualization_msgs.msg import Marker, MarkerArray  # noqa: E402

from flexarm_bringup.display.conversions import FRAME  # noqa: E402
from flexarm_bringup.display.markers_node import MarkersNode  # noqa: E402
from flexarm_bringup.installed import find_executable  # noqa: E402
from flexarm_model.conversions import model_to_msg  # noqa: E402
from flexarm_model.reading.config import load_config  # noqa: E402
from flexarm_model.reading.manipulator_file import find_manipulator  # noqa: E402
from flexarm_model.ros.node import LATCHED_QOS, MODELS_QOS, RELIABLE_QOS, events_executor  # noqa: E402
from flexarm_model.served.linearize import linearize  # noqa: E402
from flexarm_model.tree.reduced_tree import ReducedTree  # noqa: E402

THETA, ETA, PLANNED = 0.3, [2e-3, 0.0, 0.0], 0.5


@pytest.fixture
def viewer(ros_environment: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    for key, value in ros_environment.items():
        monkeypatch.setenv(key, value)
    rclpy.init()
    try:
        yield rclpy.create_node("viewer", namespace="flexarm")
    finally:
        rclpy.try_shutdown()


class Drawing:
    """A node that is shown states of the single link, and what it draws of them."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        tree = ReducedTree(load_config(find_manipulator("single_link"), "geared"), use_compiler=False)
        self.node, self.model = MarkersNode(), linearize(tree)
        self.markers: list[Any] = []
        self.segments: list[Any] = []
        monkeypatch.setattr(self.node._markers, "publish", self.markers.append)
        monkeypatch.setattr(self.node._segments, "publish", self.segments.append)
        self.node._models.add(serialize_message(model_to_msg(self.model)))

    def show(self, **changes: Any) -> None:
        """Let it hear a state."""
        state = ModalState(**({"model_id": self.model.model_id, "theta": [THETA], "eta": ETA} | changes))
        state.header.stamp.nanosec = len(self.markers)
        self.node._newest["modal_state"] = serialize_message(state)
        self.node.on_timer()


@pytest.fixture
def drawing(ros_environment: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> Iterator[Drawing]:
    for key, value in ros_environment.items():
        monkeypatch.setenv(key, value)
    rclpy.init()
    try:
        found = Drawing(monkeypatch)
        yield found
        found.node.destroy_node()
    finally:
        rclpy.try_shutdown()


def planned(markers: Any) -> Any:
    """Return the marker of the controller's plan."""
    return next(marker for marker in markers.markers if marker.ns == "tip, planned")


def shown(viewer: Any, model: Any, log: Path) -> dict[str, Any]:
    """Return what the node says of an estimate, by topic; every second time what it hears is odd."""
    heard: dict[str, Any] = {}
    for topic, kind, quality in (
        ("markers", MarkerArray, RELIABLE_QOS),
        ("segment_states", JointState, RELIABLE_QOS),
        ("robot_description", String, LATCHED_QOS),
    ):
        viewer.create_subscription(kind, topic, lambda msg, topic=topic: heard.update({topic: msg}), quality)
    models = viewer.create_publisher(ReducedModel, "model", MODELS_QOS)
    states = viewer.create_publisher(ModalState, "modal_state", RELIABLE_QOS)
    models.publish(model_to_msg(model))
    plans = viewer.create_publisher(JointTrajectory, "predicted", RELIABLE_QOS)
    points = [JointTrajectoryPoint(positions=[THETA]), JointTrajectoryPoint(positions=[PLANNED])]
    state = ModalState(model_id=model.model_id, joint_names=["base.rz"], theta=[THETA], eta=ETA)
    odd = ModalState(model_id=model.model_id, theta=[THETA, THETA], eta=ETA), b"\0\1\0\0\1\0"
    executor = events_executor()
    executor.add_node(viewer)
    node = str(find_executable("flexarm_bringup", "markers_node"))
    with log.open("wb") as out, subprocess.Popen([node], stdout=out, stderr=out) as process:
        deadline, is_odd = time.monotonic() + 60.0, False
        while (len(heard) < 3 or not planned(heard["markers"]).points) and time.monotonic() < deadline:
            is_odd = not is_odd
            for each in odd if is_odd else ():
                plans.publish(JointTrajectory(points=[JointTrajectoryPoint()]))
                states.publish(each)
                executor.spin_once(timeout_sec=0.1)
            state.header.stamp.nanosec = (state.header.stamp.nanosec + 1) % 1000
            plans.publish(JointTrajectory(points=points))
            states.publish(state)
            executor.spin_once(timeout_sec=0.02)
        process.terminate()
        assert process.wait(40) == 0, log.read_text()
    assert len(heard) == 3, log.read_text()
    return heard


def test_the_tip_is_shown_where_the_model_has_it(viewer: Any, tmp_path: Path) -> None:
    tree = ReducedTree(load_config(find_manipulator("single_link"), "geared"), use_compiler=False)
    model = linearize(tree)
    heard = shown(viewer, model, tmp_path / "log")
    expected = tree.tip_pose(model.q0 + model.Phi @ np.array([THETA, *ETA]))[:3, 3].tolist()
    tip = next(m for m in heard["markers"].markers if m.ns == "tip")
    strip = next(m for m in heard["markers"].markers if m.ns == "link strip")
    assert (tip.header.frame_id, tip.type) == (FRAME, Marker.SPHERE)
    for at in (tip.pose.position, strip.points[-1]):
        assert [at.x, at.y, at.z] == pytest.approx(expected, abs=1e-9)
    path = planned(heard["markers"])
    goal = tree.tip_pose(model.q0 + model.Phi @ np.array([PLANNED, 0.0, 0.0, 0.0]))[:3, 3].tolist()
    assert (path.type, path.action, len(path.points)) == (Marker.LINE_STRIP, Marker.ADD, 2)
    assert [path.points[-1].x, path.points[-1].y, path.points[-1].z] == pytest.approx(goal, abs=1e-9)
    moved = dict(zip(heard["segment_states"].name, heard["segment_states"].position, strict=True))
    assert moved["base.rz"] == pytest.approx(THETA)
    assert sum(value for name, value in moved.items() if name.endswith(".rz")) > THETA  # it bends on
    assert heard["robot_description"].data.startswith("<robot")


@pytest.mark.parametrize(
    ("spoilt", "told"),
    [
        ({"status": ModalState.LOST, "reason": "all sensors silent for 0.3 s"}, "the estimate is lost"),
        ({"theta": [math.nan]}, "the estimate is no number, or beyond 1e+06"),
        ({"eta": [math.inf, 0.0, 0.0]}, "the estimate is no number, or beyond 1e+06"),
        ({"eta": [1e308, 0.0, 0.0]}, "the estimate is no number, or beyond 1e+06"),
        ({"model_id": "never heard"}, "the model that the estimate quotes was not heard"),
    ],
)
def test_an_estimate_that_is_not_to_be_trusted_takes_the_picture_away(
    spoilt: dict[str, Any], told: str, drawing: Drawing, capfd: pytest.CaptureFixture[str]
) -> None:
    """It was drawn as if all were well, with numbers that were none, or by the model of another pose."""
    for changes in ({}, spoilt, spoilt, {}):
        drawing.show(**changes)
    kinds = [{marker.action for marker in markers.markers} for markers in drawing.markers]
    assert [Marker.DELETEALL in kind for kind in kinds] == [False, True, True, False]
    assert len(drawing.segments) == 2
    assert capfd.readouterr().err.count(f"nothing is drawn: {told}") == 1


def test_a_plan_with_numbers_that_are_none_is_not_drawn(drawing: Drawing) -> None:
    points = [JointTrajectoryPoint(positions=[THETA]), JointTrajectoryPoint(positions=[math.nan])]
    drawing.node._newest["predicted"] = serialize_message(JointTrajectory(points=points))
    drawing.show()
    path = planned(drawing.markers[0])
    assert path.action == Marker.DELETE and not path.points


def test_the_state_of_another_arm_is_not_drawn_and_told_once(
    ros_environment: dict[str, str], monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """The tip of a 3RRR was drawn 300 m away, and a strip's state ended the node of a 3RRR."""
    for key, value in ros_environment.items():
        monkeypatch.setenv(key, value)
    other = linearize(ReducedTree(load_config(find_manipulator("planar_3rrr"), "geared"), use_compiler=False))
    rclpy.init()
    try:
        node = MarkersNode()
        node._models.add(serialize_message(model_to_msg(other)))
        state = ModalState(model_id=other.model_id, theta=other.pose.tolist(), eta=[0.0] * other.n_eta)
        for _ in range(2):
            node._newest["modal_state"] = serialize_message(state)
            node.on_timer()
            state.header.stamp.nanosec += 1
        assert not node._shown
        node.destroy_node()
    finally:
        rclpy.try_shutdown()
    told = capfd.readouterr().err
    assert told.count("nothing is drawn: model refused: model of 'planar_3rrr'") == 1, told
