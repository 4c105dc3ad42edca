"""Model node: serves the reduced model of the arm, latched and on request.

Publishes
    model (flexarm_interfaces/ReducedModel, latched): at start, and when the pose has moved so far
        that the model differs by more than ``tolerance``; at most ``rate`` times per second.
    ~/ready (std_msgs/Bool, latched): true once the first model is out.
Subscribes
    joint_states (sensor_msgs/JointState): the pose of the actuated axes [rad or m].
Services
    get_reduced_model (flexarm_interfaces/GetReducedModel): the model at any pose.
    get_dynamics (flexarm_interfaces/GetDynamics): M, C v and G at a state of the tree.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from flexarm_interfaces.msg import ReducedModel as ReducedModelMsg
from flexarm_interfaces.srv import GetDynamics, GetReducedModel
from rclpy.node import Node
from sensor_msgs.msg import JointState

from flexarm_model.closure_error import ClosureError
from flexarm_model.config import load_config
from flexarm_model.conversions import floats, model_to_msg, stamp_to_ns
from flexarm_model.linearize import PoseError, linearize
from flexarm_model.manipulator_file import find_manipulator
from flexarm_model.model_cache import ModelCache
from flexarm_model.node import LATCHED_QOS, SENSOR_QOS, ReadyFlag, declare_config, run_node
from flexarm_model.parameters import parameter
from flexarm_model.reduced_model import ReducedModel
from flexarm_model.reduced_tree import ReducedTree


@dataclass(frozen=True)
class ModelSettings:
    """Settings of the model node."""

    manipulator: str = parameter("single_link", "Name of a manipulator that comes along, or a YAML file.")
    preset: str = parameter("geared", "Preset of that file; empty for none.")
    lockstep: bool = parameter(False, "Accepted for symmetry with the other nodes; this one has no clock.")
    rate: float = parameter(20.0, "Most models per second.", "Hz", 0.1, 100.0)
    pose_step: float = parameter(0.0175, "Pose change that makes it look again.", "rad or m", 1e-6, 1.0)
    tolerance: float = parameter(
        1e-3, "Relative change of M or the output rows that is worth a new model.", "1", 1e-9, 1.0
    )


class ModelNode(Node):
    """Serves ``linearize(tree, pose)``."""

    def __init__(self) -> None:
        """Build the tree, compile it, publish the model at home."""
        super().__init__("model", namespace="flexarm")
        self.settings = declare_config(self, ModelSettings)
        config = load_config(find_manipulator(self.settings.manipulator), self.settings.preset)
        self.tree = ReducedTree(config)
        self.cache = ModelCache(self.tree)
        self.model = self.cache.at()
        self._looked_at = self.model.pose
        self._published_ns = 0
        self._publisher = self.create_publisher(ReducedModelMsg, "model", LATCHED_QOS)
        self._publish(0)
        self.create_subscription(JointState, "joint_states", self.on_joint_states, SENSOR_QOS)
        self.create_service(GetReducedModel, "get_reduced_model", self.on_get_reduced_model)
        self.create_service(GetDynamics, "get_dynamics", self.on_get_dynamics)
        self._ready = ReadyFlag(self, {"model": lambda: True})
        f_hz = ", ".join(f"{value:.4g}" for value in self.model.omega / (2 * np.pi))
        self.get_logger().info(
            f"{config.name} ({config.preset or 'no preset'}): modes at {f_hz} Hz, model {self.model.model_id}"
        )

    def on_joint_states(self, msg: JointState) -> None:
        """Serve a new model when the arm has moved far enough for it to differ."""
        position = dict(zip(msg.name, msg.position, strict=False))
        pose = np.array([position.get(name, np.nan) for name in self.model.theta_names])
        if (
            not np.isfinite(pose).all()
            or abs(pose - self._looked_at).max(initial=0.0) < self.settings.pose_step
        ):
            return
        now_ns = stamp_to_ns(msg.header.stamp)
        if 0 <= now_ns - self._published_ns < 1e9 / self.settings.rate:
            return
        self._looked_at = pose
        try:
            model = linearize(self.tree, pose)  # a moving arm hardly comes back to the same bits
        except (PoseError, ClosureError) as error:
            self.get_logger().warning(str(error), throttle_duration_sec=5.0)
            return
        if model_difference(model, self.model) > self.settings.tolerance:
            self.model = model
            self._publish(now_ns)

    def on_get_reduced_model(
        self, request: GetReducedModel.Request, response: GetReducedModel.Response
    ) -> GetReducedModel.Response:
        """Answer with the model at the requested pose."""
        try:
            model = self.cache.at(np.array(request.pose)) if request.pose else self.model
        except (PoseError, ClosureError) as error:
            response.success, response.message = False, str(error)
            return response
        response.success, response.model = True, model_to_msg(model)
        return response

    def on_get_dynamics(
        self, request: GetDynamics.Request, response: GetDynamics.Response
    ) -> GetDynamics.Response:
        """Answer with M(q), C(q, v) v and G(q)."""
        n = self.tree.n_q
        q = np.array(request.q) if request.q else np.array(self.model.q0)
        v = np.array(request.v) if request.v else np.zeros(n)
        if q.size != n or v.size != n or not np.isfinite([q, v]).all():
            response.success = False
            response.message = f"q and v need {n} finite numbers each: {', '.join(self.tree.coordinates)}"
            return response
        static = np.array(self.tree.functions["bias"](q, np.zeros(n)))
        response.success, response.names = True, list(self.tree.coordinates)
        response.coriolis = floats(np.array(self.tree.functions["bias"](q, v)) - static)
        response.gravity = floats(static)
        response.mass = floats(np.array(self.tree.functions["mass_matrix"](q)))
        return response

    def _publish(self, stamp_ns: int) -> None:
        self._published_ns = stamp_ns
        self._publisher.publish(model_to_msg(self.model, stamp_ns))


def model_difference(a: ReducedModel, b: ReducedModel) -> float:
    """Return the largest change of M, K or an output row, relative to its size [1]."""
    pairs = [(a.M, b.M), (a.K, b.K), (a.f0, b.f0)]
    pairs += [(getattr(a.outputs, name), getattr(b.outputs, name)) for name in ("C_pos", "C_vel", "C_acc")]
    return max(float(abs(x - y).max(initial=0.0) / max(abs(y).max(initial=0.0), 1.0)) for x, y in pairs)


def main() -> int:
    """Run the node."""
    return run_node(ModelNode)
