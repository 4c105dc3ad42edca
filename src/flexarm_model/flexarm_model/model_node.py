"""Model node: serves the reduced model of the arm, ahead of a motion, latched and on request.

A model is used from its stamp on. For a reference all models of the motion are made and sent before it
starts, in a fixed distance from each other, as a pure function of the reference. Without one the models
follow the measured pose, not in lockstep, where nothing may depend on how fast a node is.

Publishes
    model (flexarm_interfaces/ReducedModel, latched): at start; all models of a reference; and without one
        when the pose has moved so far that the model differs by more than ``tolerance``, at most ``rate``
        times per second.
    ~/models (std_msgs/String, latched): "stamp of the reference: receipt" once all its models are out, or
        "stamp: refused: reason".
    /diagnostics (diagnostic_msgs/DiagnosticArray): 1 Hz.
    ~/ready (std_msgs/Bool, latched): true once the first model is out and libraries are loaded.
Subscribes
    reference (trajectory_msgs/JointTrajectory): what the axes are about to do.
    joint_states (sensor_msgs/JointState): the pose of the actuated axes [rad or m].
    controller/references (std_msgs/String): "stamp: verdict"; models of refused ones are taken back.
    guard_status (flexarm_interfaces/GuardStatus): after a stop the models follow the measured pose again.
    parameters/<name> (sensor_msgs/FluidPressure or std_msgs/Float64): a parameter that springs or dampers of
        the arm follow; not in lockstep. All models from now on are of its value, those of a motion, too.
Services
    See ``model_services_node``.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice

import numpy as np
from flexarm_interfaces.msg import GuardStatus
from flexarm_interfaces.msg import ReducedModel as ReducedModelMsg
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from trajectory_msgs.msg import JointTrajectory

from flexarm_model.conversions import NS_PER_S, model_to_msg, stamp_to_ns
from flexarm_model.manipulator.start_pose import starting_at
from flexarm_model.model_services_node import ModelServices
from flexarm_model.motion.conversions import TrajectoryMessageError, trajectory_from_msg
from flexarm_model.motion.size import has_too_many_points
from flexarm_model.motion.told import told_of_reference
from flexarm_model.process.ahead import made
from flexarm_model.ros.bytes_node import subscribe_bytes
from flexarm_model.ros.declared_node import declare_configs, load_arm, told_by
from flexarm_model.ros.diagnostics_node import Diagnostics
from flexarm_model.ros.managed_node import LifeSettings, ManagedNode
from flexarm_model.ros.node import (
    MODELS_DEPTH,
    MODELS_QOS,
    RELIABLE_QOS,
    SENSOR_QOS,
    TOLD_QOS,
    run_node,
)
from flexarm_model.ros.parameters_node import subscribe_parameters
from flexarm_model.served.linearize import PoseError, linearize
from flexarm_model.served.model_cache import ModelCache, cache_at_home
from flexarm_model.served.model_difference import model_difference
from flexarm_model.served.model_schedule import ModelSchedule, ScheduleSettings, periods_between_looks
from flexarm_model.served.parameter_watch import PARAMETER_STEP, ParameterWatch
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.served.served_models import ServedModels
from flexarm_model.settings.arm_settings import ArmSettings
from flexarm_model.settings.diagnosis import Level, Verdict
from flexarm_model.settings.parameters import parameter
from flexarm_model.tree.closure_error import ClosureError

AHEAD = (cache_at_home,)  # see flexarm_model.process.ahead
LIBRARIES = ("scipy.interpolate",)  # for references that give positions alone
FOLLOWING_LEAD_NS = 100_000_000  # a model of the measured pose holds so much later: all must have it by then


@dataclass(frozen=True)
class ModelSettings(ArmSettings):
    """Settings of the model node."""

    start: tuple[float, ...] = parameter((), "Axes at the start; empty: home.", "rad or m")
    lockstep: bool = parameter(False, "Serve the models of references only; never follow the measured pose.")
    rate: float = parameter(20.0, "Most models per second.", "Hz", 0.1, 100.0)
    pose_step: float = parameter(0.0175, "Pose change that makes it look again.", "rad or m", 1e-6, 1.0)
    tolerance: float = parameter(
        1e-3, "Relative change of M or the output rows that is worth a new model.", "1", 1e-9, 1.0
    )
    parameter_step: float = parameter(
        PARAMETER_STEP, "Change of a parameter of the arm that is worth models, of its range.", "1", 1e-6, 1.0
    )


class ModelNode(ManagedNode):
    """Serves ``linearize(tree, pose)``."""

    SETTINGS = (ModelSettings, ScheduleSettings, LifeSettings)

    def __init__(self) -> None:
        """Read the description."""
        super().__init__("model")
        self.settings: ModelSettings
        self._schedule: ScheduleSettings
        self.settings, self._schedule, life = declare_configs(self)
        config = load_arm(self, self.settings.manipulator, self.settings.preset)
        with told_by(self, "start"):
            self._config = starting_at(config, self.settings.start)
        self._period_ns = round(NS_PER_S / config.rate_hz) * periods_between_looks(1.0 / config.rate_hz)
        self.start(life)

    def configure(self) -> None:
        """Build the tree and compile it."""
        self._described = self.cache = made(cache_at_home, self._config)

    def activate(self) -> None:
        """Publish the model at home."""
        self.cache, config = self._described, self._config
        model = self.cache.at()
        self._watched = ParameterWatch(config, self.settings.parameter_step)
        self._renewed_ns, self._receipt_ns = -NS_PER_S, -1
        self._follows_pose = self._followed_pose = not self.settings.lockstep
        self._looked_at, self._published_ns, self._trouble = model.pose, 0, ""
        self._token, self._awaited, self._refused_ns = 0, False, -1
        self._connect(model)
        f_hz = ", ".join(f"{value:.4g}" for value in model.omega / (2 * np.pi))
        self.get_logger().info(
            f"{config.name} ({config.preset or 'no preset'}): modes at {f_hz} Hz, model {model.model_id}"
        )

    def on_reference(self, msg: JointTrajectory) -> None:
        """Make the models of a motion, send them, and tell that all are out."""
        start_ns = stamp_to_ns(msg.header.stamp)
        if start_ns == self._refused_ns:  # the controller was quicker
            self._refused_ns = -1
            return
        try:
            plan = self._plan(msg, start_ns)
        except (TrajectoryMessageError, PoseError, ClosureError) as error:
            self._trouble = f"no models for the reference: {error}"
            self.get_logger().error(self._trouble)
            self._receipts.publish(String(data=f"{start_ns}: refused: {error}"))
            return
        self._followed_pose, self._follows_pose, self._trouble = self._follows_pose, False, ""
        self._served.serve_motion(plan, start_ns)
        self.get_logger().info(f"{len(plan)} models for the reference")
        self._receipt_ns = start_ns
        self._tell_receipt()

    def on_verdict(self, msg: String) -> None:
        """Take the models of a reference back that the controller does not follow."""
        stamp_ns, words = told_of_reference(msg.data)
        if not words.startswith("reference refused"):
            return
        if self._served.take_back(stamp_ns):
            self._follows_pose = self._followed_pose
            self.get_logger().info("the reference was refused: its models are taken back")
        else:
            self._refused_ns = stamp_ns

    def on_guard_status(self, msg: GuardStatus) -> None:
        """After a stop nobody follows the reference: look where the arm is."""
        if self._token and not msg.session_token and not self.settings.lockstep:
            self._follows_pose = self._followed_pose = True
            self._looked_at = np.full_like(self._served.newest.pose, np.inf)
        self._token, self._awaited = msg.session_token, bool(msg.session_token) and not self.settings.lockstep

    def on_joint_states(self, msg: JointState) -> None:
        """Serve a new model when the arm has moved far enough for it to differ."""
        now_ns = stamp_to_ns(msg.header.stamp)
        self._served.pass_by(now_ns)
        self._renew(now_ns)
        if not self._follows_pose:
            return
        position, newest = dict(zip(msg.name, msg.position, strict=False)), self._served.newest
        pose = np.array([position.get(name, np.nan) for name in newest.theta_names])
        is_far = abs(pose - self._looked_at).max(initial=0.0) >= self.settings.pose_step
        if not (is_far and np.isfinite(pose).all()):
            return
        if 0 <= now_ns - self._published_ns < NS_PER_S / self.settings.rate:
            return
        self._looked_at = pose
        try:
            model = linearize(self.cache.tree, pose)  # a moving arm hardly comes back to the same bits
        except (PoseError, ClosureError) as error:
            self._trouble = str(error)
            self.get_logger().warning(self._trouble, throttle_duration_sec=5.0)
            return
        self._trouble = ""
        is_other = model_difference(model, newest) > self.settings.tolerance
        if is_other or self._served.has_after(now_ns + FOLLOWING_LEAD_NS):
            self._published_ns = now_ns
            self._served.serve(model, now_ns + FOLLOWING_LEAD_NS)

    def verdicts(self) -> list[Verdict]:
        """Judge what became of the last reference and pose."""
        served, level = self._served, Level.ERROR if self._trouble else Level.OK
        values = {"model_id": served.newest.model_id, "models served": str(served.count)}
        told = [Verdict("model: served", level, self._trouble or "ok", values)]
        if used := {name: f"{value:.6g}" for name, value in self._watched.used.items()}:
            doubt = self._watched.trouble
            told.append(Verdict("model: parameters", Level.WARN if doubt else Level.OK, doubt or "ok", used))
        return told

    def _renew(self, now_ns: int) -> None:
        """Go on to send the models of an arm whose parameters have changed, where that is due."""
        values, least_ns = self._watched.told(), NS_PER_S / self.settings.rate
        try:
            is_sent = self._served.go_on(now_ns)
            if self._watched.is_due and not 0 <= now_ns - self._renewed_ns < least_ns:
                cache, self._renewed_ns = ModelCache(self._described.tree.under(values)), now_ns
                self._served.renew(cache.at, now_ns + FOLLOWING_LEAD_NS)
                self._watched.use(values)
                self.cache, is_sent = cache, True
        except (PoseError, ClosureError) as error:
            self._watched.refused = f"no models for {values}: {error}"
            self.get_logger().error(self._watched.refused, throttle_duration_sec=5.0)
            return
        if is_sent and self._receipt_ns >= 0:
            self._tell_receipt()

    def _tell_receipt(self) -> None:
        self._receipts.publish(String(data=f"{self._receipt_ns}: {self._served.receipt}"))

    def _plan(self, msg: JointTrajectory, start_ns: int) -> list[tuple[int, ReducedModel]]:
        in_use = self._served.at(start_ns)
        motion = trajectory_from_msg(msg, in_use.theta_names, start_ns)
        schedule = ModelSchedule(self.cache.tree, self._config, motion, self._schedule)
        plan = schedule.plan(in_use, float(motion.t[-1]), self._period_ns)
        models = list(islice(plan, MODELS_DEPTH))
        if len(models) == MODELS_DEPTH:
            raise TrajectoryMessageError(f"it needs {MODELS_DEPTH} models or more; raise angle or length")
        return models

    def _connect(self, first: ReducedModel) -> None:
        models = self.create_publisher(ReducedModelMsg, "model", MODELS_QOS)
        self._receipts = self.create_publisher(String, "~/models", TOLD_QOS)
        self._served = ServedModels(first, lambda model, ns: models.publish(model_to_msg(model, ns)))
        heard = JointTrajectory, "reference", self.on_reference, RELIABLE_QOS
        subscribe_bytes(self, *heard, too_large=lambda raw: has_too_many_points(raw, self._awaited))
        subscribe_bytes(self, JointState, "joint_states", self.on_joint_states, SENSOR_QOS)
        self.create_subscription(String, "controller/references", self.on_verdict, RELIABLE_QOS)
        self.create_subscription(GuardStatus, "guard_status", self.on_guard_status, RELIABLE_QOS)
        if not self.settings.lockstep:
            self._watched.silence = subscribe_parameters(self, self._config, self._watched.hear)
        self._answering = ModelServices(self, lambda: self.cache, lambda: self._served.newest)
        self.tell_ready({"model": lambda: True}, LIBRARIES)
        self._diagnostics = Diagnostics(self, self.verdicts)


def main() -> int:
    """Run the node."""
    return run_node(ModelNode)
