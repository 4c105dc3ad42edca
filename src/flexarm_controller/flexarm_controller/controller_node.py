"""Controller node: torques that follow a reference and leave the arm still.

Publishes
    joint_commands (flexarm_interfaces/JointCommand): one per modal_state while the guard is armed.
    controller_status (flexarm_interfaces/ControllerStatus): one per modal_state but at most 200 per
        second (see ``answer``), and at once for every reference or model that is taken or refused.
    ~/margins (std_msgs/String, latched): see ``margins/arming_node``.
    controller_debug (flexarm_interfaces/ControllerDebug): one per joint_commands while somebody listens.
    feedback_gains (flexarm_interfaces/FeedbackGains): one per joint_commands that the law itself made, while
        somebody listens.
    predicted (trajectory_msgs/JointTrajectory): motion of the axes that the plan leads to, from the time on
        from which it acts; 20 a second while somebody listens.
    motion_status, reference: see ``motion/tip_goals_node``.
    stop (std_msgs/Empty): an arm with weight whose state is lost is to be held by the guard, see ``ladder``.
    ~/models (std_msgs/String, latched): receipt of the models taken and prepared so far.
    ~/references (std_msgs/String): "stamp: verdict" of every reference of others, for who prepares it.
    /diagnostics (diagnostic_msgs/DiagnosticArray): 1 Hz.
    ~/ready (std_msgs/Bool, latched): true once it has a model and its topics are connected.
Subscribes
    model (flexarm_interfaces/ReducedModel, latched), reference (trajectory_msgs/JointTrajectory).
    model/models (std_msgs/String, latched): a motion for which there are no models, or of which nothing is
        said, ends at rest; not heard in lockstep, where who commands waits for them.
    modal_state, guard_status, tick: see ``states_node``.

In real time only the newest state is answered when several wait: what was missed is skipped, and counted in
``missed_cycles``.
"""

from __future__ import annotations

import secrets
import time
from collections.abc import Sequence
from dataclasses import replace

from flexarm_interfaces.msg import (
    ControllerDebug,
    ControllerStatus,
    FeedbackGains,
    GuardStatus,
    JointCommand,
    ReducedModel,
)
from rclpy.clock import Clock, ClockType
from rclpy.serialization import serialize_message
from std_msgs.msg import Empty, String
from trajectory_msgs.msg import JointTrajectory

from flexarm_controller.answer import Outgoing
from flexarm_controller.command_writer import CommandWriter
from flexarm_controller.controller_health import ControllerHealth
from flexarm_controller.debug import Insight
from flexarm_controller.exchange import ControllerExchange
from flexarm_controller.laws import LawInputs
from flexarm_controller.limits import limits_of
from flexarm_controller.margins.arming_node import ArmingCheck
from flexarm_controller.motion.draft import PlanningProcess
from flexarm_controller.motion.motion_exchange import MotionExchange
from flexarm_controller.motion.settings import MotionConfig
from flexarm_controller.motion.tip_goals_node import TipGoals
from flexarm_controller.motion.tip_kinematics import TipKinematics
from flexarm_controller.nonlinear.settings import NmpcConfig
from flexarm_controller.settings import ControllerConfig, MarginConfig, MpcConfig
from flexarm_controller.states_node import Duties, PacedStates, States, TickedStates
from flexarm_controller.status_writer import StatusWriter
from flexarm_controller.time_budget import Clocks
from flexarm_controller.told_state import ToldState
from flexarm_model.conversions import stamp_to_ns
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.motion.size import has_too_many_points
from flexarm_model.process.ahead import made
from flexarm_model.process.beside import Beside
from flexarm_model.ros.arriving_models import QUIET, ArrivingModels
from flexarm_model.ros.bytes_node import subscribe_bytes
from flexarm_model.ros.declared_node import declare_configs, load_arm
from flexarm_model.ros.diagnostics_node import Diagnostics
from flexarm_model.ros.managed_node import LifeSettings, ManagedNode
from flexarm_model.ros.node import LATCHED_QOS, LOCKSTEP_QOS, MODELS_QOS, PERIODIC_QOS, RELIABLE_QOS, run_node
from flexarm_model.settings.arm_settings import LoopSettings
from flexarm_model.settings.diagnosis import DiagnosticsConfig
from flexarm_model.tree.reduced_tree import ReducedTree

GOALS = 100_000  # numbers of one life of the node: nobody shall take another's goal for his own
LIBRARIES = ("scipy.interpolate",)  # for references that give positions alone


class ControllerNode(ManagedNode):
    """Connects a ``ControllerExchange`` to topics."""

    SETTINGS = (
        LoopSettings, ControllerConfig, MpcConfig, NmpcConfig, MotionConfig, MarginConfig,
        DiagnosticsConfig, LifeSettings,
    )  # fmt: skip

    def __init__(self) -> None:
        """Load the manipulator."""
        super().__init__("controller")
        self.settings: LoopSettings
        self._motion: MotionConfig
        self.settings, laws, mpc, nmpc, self._motion, self._margins, self._thresholds, life = declare_configs(
            self
        )
        self._config = load_arm(self, self.settings.manipulator, self.settings.preset)
        self._inputs = LawInputs(limits_of(self._config), laws, mpc, self._config, nmpc)
        self.start(life)

    def configure(self) -> None:
        """Build the kinematics of the tip."""
        self._tip = made(_tip_of, self._config)

    def activate(self) -> None:
        """Begin without model, state and session; subscribe."""
        config, inputs, motion = self._config, self._inputs, self._motion
        period = inputs.config.period
        self._health = ControllerHealth(None if self.settings.lockstep else period, self._thresholds)
        self.exchange = self._exchange(config, inputs, motion)
        self._arming = ArmingCheck(self, config, inputs, self._margins, self.exchange)
        before = 0 if self.settings.lockstep else GOALS * secrets.randbelow(GOALS)
        goals = MotionExchange(config, self._tip, motion, period, self.exchange, before)
        beside = None if self.settings.lockstep else Beside("planner", PlanningProcess, config, motion)
        self._goals = TipGoals(self, goals, self._publish, beside)
        self.exchange.write = CommandWriter(serialize_message).write
        self.exchange.teller.write_status = StatusWriter(serialize_message).write
        self.exchange.teller.tell_more(Insight(self._tip.at, inputs.mpc, period), self._listens)
        self._connect()

    def deactivate(self) -> None:
        """Say what becomes of a goal that is pursued; commands end, and the guard stops the arm by that."""
        self._goals.end("the controller is not active any more")

    def _exchange(
        self, config: ManipulatorConfig, inputs: LawInputs, motion: MotionConfig
    ) -> ControllerExchange:
        """Return the exchange; in lockstep its results must not depend on how busy the machine is."""
        if self.settings.lockstep:
            mpc = replace(inputs.mpc, time_limit=0.0)
            return ControllerExchange(config, inputs.config, mpc, 0, None, motion, inputs.nmpc)
        clocks = Clocks(wall=time.perf_counter)
        return ControllerExchange(config, inputs.config, inputs.mpc, None, clocks, motion, inputs.nmpc)

    def take_model(self, msg: ReducedModel) -> None:
        """Take a model, to be used from its stamp on, or say why not."""
        self._publish(self.exchange.on_model(msg))
        self._receipts.publish(String(data=self.exchange.receipt))
        self._arming.look()
        if self.exchange.model_fault:
            self.get_logger().error(self.exchange.model_fault)

    def on_reference(self, msg: JointTrajectory) -> None:
        """Take a reference, or say why not."""
        if self._goals.is_own(msg):
            return
        verdict = self._goals.take(msg)
        self.get_logger().info(verdict)
        self._verdicts.publish(String(data=f"{stamp_to_ns(msg.header.stamp)}: {verdict}"))

    def on_too_large_reference(self, reason: str) -> None:
        """Say why a reference is not even read."""
        self._publish(self.exchange.refuse_reference(reason))

    def on_state(self, told: ToldState) -> None:
        """Take a state that another node of this process hands over."""
        self._states.on_state(told)

    def join(self, msg: GuardStatus) -> None:
        """Take the session of the guard, or say what of the last one is not gone on with."""
        told = self.exchange.on_guard_status(msg)
        for out in told:
            self.get_logger().warning(out.msg.reason)
        self._publish(told)

    def answer(self, told: ToldState) -> None:
        """Send the command for a state; everything else comes after it."""
        self._arming.look()
        self._arriving.take_due(told.stamp_ns)
        self._publish(self.exchange.on_state(told))
        self._publish(self.exchange.tell())
        if (answer := self.exchange.answer) is not None:
            if answer.is_left:
                self._halt.publish(Empty())
            self._health.note(time.perf_counter(), answer.mode, answer)

    def work_ahead(self) -> None:
        """Do what has time until the next state."""
        self.exchange.work_ahead()
        self._goals.update()
        self._arriving.work_ahead()

    def _is_awaited(self) -> bool:
        return self.exchange.is_armed and not self.settings.lockstep

    def _listens(self, topic: str) -> bool:
        return bool(self._outlets[topic].get_subscription_count())

    def _publish(self, outgoing: Sequence[Outgoing]) -> None:
        for out in outgoing:
            self._outlets[out.topic].publish(out.msg)

    def _connect(self) -> None:
        quality = LOCKSTEP_QOS if self.settings.lockstep else PERIODIC_QOS
        self._outlets = {
            "joint_commands": self.create_publisher(JointCommand, "joint_commands", quality),
            # deep: what it says of a reference must reach a slow commander among the states' answers
            "controller_status": self.create_publisher(ControllerStatus, "controller_status", LOCKSTEP_QOS),
        }
        for topic, kind in (("controller_debug", ControllerDebug), ("predicted", JointTrajectory)):
            self._outlets[topic] = self.create_publisher(kind, topic, quality)
        self._outlets["feedback_gains"] = self.create_publisher(FeedbackGains, "feedback_gains", quality)
        self._outlets.update(self._goals.outlets)
        self._halt = self.create_publisher(Empty, "stop", RELIABLE_QOS)
        self._receipts = self.create_publisher(String, "~/models", LATCHED_QOS)
        self._verdicts = self.create_publisher(String, "~/references", RELIABLE_QOS)
        self._arriving = ArrivingModels(self.take_model, not self.settings.lockstep)
        self.create_subscription(ReducedModel, "model", self._arriving.add, MODELS_QOS)
        self.create_timer(QUIET, self._arriving.look, clock=Clock(clock_type=ClockType.STEADY_TIME))
        heard = JointTrajectory, "reference", self.on_reference, RELIABLE_QOS, self.on_too_large_reference
        subscribe_bytes(self, *heard, lambda raw: has_too_many_points(raw, self._is_awaited()))
        self._states = self._subscribed_states()
        conditions = {
            "a model": lambda: self.exchange.controller is not None,
            "margins": lambda: self._arming.is_known,
            "the estimator": lambda: self.has_publisher("modal_state"),
            "the rig": lambda: self._outlets["joint_commands"].get_subscription_count() > 0,
            "the guard": lambda: self.has_publisher("guard_status"),
        }
        if self.settings.lockstep:
            conditions["ticks"] = lambda: self.has_publisher("tick")
        self.tell_ready(conditions, LIBRARIES)
        self._diagnostics = Diagnostics(self, self._health.verdicts)

    def _subscribed_states(self) -> States:
        duties = Duties(self.join, self.answer, self.work_ahead)
        if self.settings.lockstep:
            return TickedStates(self, duties)
        return PacedStates(self, duties, self._inputs.config.period)


def _tip_of(arm: ManipulatorConfig) -> TipKinematics:
    return TipKinematics(ReducedTree(arm))


AHEAD = (_tip_of,)  # see flexarm_model.process.ahead


def main() -> int:
    """Run the node."""
    return run_node(ControllerNode)
