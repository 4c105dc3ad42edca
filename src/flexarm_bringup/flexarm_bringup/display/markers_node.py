"""Markers node: the arm as it bends, for RViz and Foxglove. It only listens and is never in the loop.

Publishes
    markers (visualization_msgs/MarkerArray): links, joints, tip with its 3-sigma ellipsoid, where the
        controller plans to move it, in "base".
    robot_description (std_msgs/String, latched): URDF with segment joints along every body that bends.
    segment_states (sensor_msgs/JointState): position of all its joints [rad or m], for robot_state_publisher.
    ~/ready (std_msgs/Bool, latched): true once the description is out.
Subscribes
    modal_state (flexarm_interfaces/ModalState), model (flexarm_interfaces/ReducedModel, latched),
    end_effector (nav_msgs/Odometry: covariance of the tip), predicted (trajectory_msgs/JointTrajectory: the
        controller's plan), all best effort.

Coordinates of the tree are those of the served model (``shape``); elastic modes too small to be seen are
shown ``magnification`` times as large. Everything goes out ``rate`` times a second, whatever comes in. What
cannot be trusted is not drawn (``doubted``): all markers are taken away until it can.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from flexarm_interfaces.msg import ModalState
from flexarm_interfaces.msg import ReducedModel as ReducedModelMsg
from nav_msgs.msg import Odometry
from numpy.typing import NDArray
from rclpy.clock import Clock, ClockType
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from trajectory_msgs.msg import JointTrajectory
from visualization_msgs.msg import MarkerArray

from flexarm_bringup.display.conversions import NO_PLAN, markers_msg, nothing_msg, segments_msg
from flexarm_bringup.display.doubted import not_drawn
from flexarm_bringup.display.ellipsoid import Ellipsoid, three_sigma
from flexarm_bringup.display.segment_graph import SegmentGraph
from flexarm_bringup.display.shape import coordinates
from flexarm_bringup.display.urdf import urdf
from flexarm_bringup.model_view.mechanism_lines import MechanismLines
from flexarm_bringup.monitor.model_book import ModelBook
from flexarm_model.conversions import model_from_msg, stamp_to_ns
from flexarm_model.ros.declared_node import declare_configs, load_arm
from flexarm_model.ros.logger_node import FastLogging
from flexarm_model.ros.node import (
    LATCHED_QOS,
    MODELS_QOS,
    RELIABLE_QOS,
    SENSOR_QOS,
    ReadyFlag,
    run_node,
)
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.settings.arm_settings import ArmSettings
from flexarm_model.settings.parameters import parameter
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
HEARD = (("modal_state", ModalState), ("end_effector", Odometry), ("predicted", JointTrajectory))
RECENT_NS = 500_000_000  # of a plan
CORNERS = 10  # of its path, about


@dataclass(frozen=True)
class MarkersSettings(ArmSettings):
    """Settings of the markers node."""

    lockstep: bool = parameter(False, "As the other nodes; it shows the newest state either way.")
    rate: float = parameter(15.0, "Pictures per second of wall time.", "Hz", 0.1, 60.0)
    magnification: float = parameter(1.0, "Elastic modes are shown so many times as large.", "1", 0.0, 1e4)
    stations: int = parameter(10, "Segments of every beam in the URDF.", "1", 1, 100)


class MarkersNode(FastLogging):
    """Shows the newest estimate."""

    SETTINGS = (MarkersSettings,)

    def __init__(self) -> None:
        """Lay out the arm and publish its description."""
        super().__init__("markers", namespace="flexarm")
        self.settings: MarkersSettings
        (self.settings,) = declare_configs(self)
        self._config, self._told = load_arm(self, self.settings.manipulator, self.settings.preset), ""
        tree = ReducedTree(self._config, use_compiler=False)
        self._lines, self._graph = MechanismLines(tree), SegmentGraph(tree, self.settings.stations)
        self._elastic = frozenset(name for name in tree.bodies if tree.elastic_coordinates(name))
        self._models = ModelBook(lambda raw: model_from_msg(deserialize_message(raw, ReducedModelMsg)))
        self._newest: dict[str, bytes] = {}
        self._shown = b""
        self._connect(urdf(self._config, self._graph))

    def on_timer(self) -> None:
        """Show the newest state, once."""
        raw = self._newest.get("modal_state", b"")
        state = self._read("modal_state", ModalState) if raw and raw != self._shown else None
        model = self._models.find(state.model_id) if state is not None else None
        if model is None or state is None or self._is_doubted(state, model):
            return
        if (len(state.theta), len(state.eta)) != (model.n_theta, model.n_eta):
            return
        self._shown = raw
        q = coordinates(model, np.array(state.theta), np.array(state.eta), self.settings.magnification)
        lines, joints, tip = self._lines.lines(q), self._lines.joints(q), self._lines.tip(q)[:3, 3]
        plan = self._plan(model, stamp_to_ns(state.header.stamp))
        self._markers.publish(markers_msg(lines, self._elastic, joints, tip, self._doubt(), plan))
        self._segments.publish(segments_msg(self._graph.values(q), state.header.stamp))

    def _is_doubted(self, state: ModalState, model: ReducedModel) -> bool:
        """Take everything away when the state cannot be drawn, and tell why when that changes."""
        fault = not_drawn(state, model, self._config)
        if fault and fault != self._told:
            self.get_logger().error(f"nothing is drawn: {fault}")
        self._told = fault
        if fault:
            self._markers.publish(nothing_msg())
        return bool(fault)

    def _plan(self, model: ReducedModel, now_ns: int) -> Array:
        """Return where the tip goes by the plan, modes at rest [m], (k, 3); empty without a recent one."""
        plan = self._read("predicted", JointTrajectory) or JointTrajectory()
        age_ns = now_ns - stamp_to_ns(plan.header.stamp)
        if not plan.points or abs(age_ns) > RECENT_NS:
            return NO_PLAN
        corners = plan.points[:: max(len(plan.points) // CORNERS, 1)]
        if not all(_are_axes(point.positions, model.n_theta) for point in corners):
            return NO_PLAN
        at_rest = np.zeros(model.n_eta)
        poses = [np.array(point.positions) for point in corners]
        return np.array([self._lines.tip(coordinates(model, theta, at_rest, 1.0))[:3, 3] for theta in poses])

    def _doubt(self) -> Ellipsoid | None:
        tip = self._read("end_effector", Odometry)
        return None if tip is None else three_sigma(np.array(tip.pose.covariance).reshape(6, 6)[:3, :3])

    def _read(self, topic: str, kind: Any) -> Any:
        """Return the newest message of a topic; None without one, or where its bytes are no such."""
        raw = self._newest.get(topic)
        try:
            return None if raw is None else deserialize_message(raw, kind)
        except rclpy_implementation.RMWError:
            return None

    def _connect(self, description: str) -> None:
        self._markers = self.create_publisher(MarkerArray, "markers", RELIABLE_QOS)
        self._segments = self.create_publisher(JointState, "segment_states", RELIABLE_QOS)
        self._description = self.create_publisher(String, "robot_description", LATCHED_QOS)
        self._description.publish(String(data=description))
        self.create_subscription(ReducedModelMsg, "model", self._models.add, MODELS_QOS, raw=True)
        for topic, kind in HEARD:
            self.create_subscription(kind, topic, self._keeper(topic), SENSOR_QOS, raw=True)
        self.create_timer(
            1.0 / self.settings.rate, self.on_timer, clock=Clock(clock_type=ClockType.STEADY_TIME)
        )
        self._ready = ReadyFlag(self, {"description": lambda: True})

    def _keeper(self, topic: str) -> Any:
        def keep(raw: bytes) -> None:
            """Keep the newest message of the topic."""
            self._newest[topic] = raw

        return keep


def _are_axes(positions: Sequence[float], n: int) -> bool:
    return len(positions) == n and bool(np.isfinite(positions).all())


def main() -> int:
    """Run the node."""
    return run_node(MarkersNode)
