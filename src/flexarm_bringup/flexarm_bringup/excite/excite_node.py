"""Excite node: a modal test of the arm through its guard, over DDS; then it ends.

It waits for its partners, makes sure that the arm stands at its pose and that no controller is active, arms
the guard, holds the arm by joint PD, checks the sensors and adds the excitation to the torque. At the end it
stops the guard, and whenever something is wrong. It exits with 0 when all was done, else with 1 and a reason.
A bag of it is what ``flexarm identify BAG`` reads.

Publishes
    joint_commands (flexarm_interfaces/JointCommand): one per joint_states while the guard is armed.
    excitation (sensor_msgs/JointState): the part of every command that excites, same stamp.
    ~/test (std_msgs/String, latched): plan, sensor check and starts of the runs once it has ended, as JSON.
    stop (std_msgs/Empty): when it is interrupted.
Subscribes
    joint_states (sensor_msgs/JointState), strain (flexarm_interfaces/StrainArray), imu/<name>
    (sensor_msgs/Imu), applied_effort (sensor_msgs/JointState), model (flexarm_interfaces/ReducedModel,
    latched), guard_status (flexarm_interfaces/GuardStatus), ~/ready of the partners.
Calls
    guard/arm, guard/stop (std_srvs/Trigger).
"""

from __future__ import annotations

import sys
import time
from functools import partial
from typing import Any

import numpy as np
from flexarm_interfaces.msg import GuardStatus, JointCommand, ReducedModel, StrainArray
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Empty, String
from std_srvs.srv import Trigger

from flexarm_bringup.excite.held_arm import HeldArm
from flexarm_bringup.excite.live import LiveTest
from flexarm_bringup.excite.partners_node import Partners
from flexarm_bringup.excite.plan import plan_excitation
from flexarm_bringup.excite.settings import ExciteSettings, wish_of
from flexarm_bringup.excite.told import to_text
from flexarm_bringup.excite.told_axes import UntoldError, told_axes
from flexarm_bringup.series import Series, SeriesError
from flexarm_bringup.topics import NAMELESS
from flexarm_estimator.messages.inbox import TORQUE_TOPIC
from flexarm_model.conversions import floats, stamp_to_ns
from flexarm_model.manipulator.cameras import CAMERA
from flexarm_model.manipulator.start_pose import starting_at
from flexarm_model.ros.declared_node import declare_configs, load_arm, told_by
from flexarm_model.ros.logger_node import FastLogging
from flexarm_model.ros.node import LATCHED_QOS, LOCKSTEP_QOS, MODELS_QOS, RELIABLE_QOS, SENSOR_QOS, run_node
from flexarm_model.served.pending_models import PendingModels
from flexarm_model.settings.parameters import ParameterError

LOOK_PERIOD = 0.02  # s of wall time between two looks at the state of affairs
LOOKED_AROUND = 1.0  # s after which a controller on the network is known
AT_POSE = 0.01  # rad or m; an arm that stands elsewhere would be pulled
ACKNOWLEDGED = 2.0  # s for the recorder to take the last words
COMMANDS = "joint_commands"


class ExciteNode(FastLogging):
    """Steps: wait for partners, arm, test, stop."""

    SETTINGS = (ExciteSettings,)

    def __init__(self) -> None:
        """Plan the test and connect."""
        super().__init__("excite", namespace="flexarm")
        self.settings: ExciteSettings
        self._call: Any
        (self.settings,) = (s,) = declare_configs(self)
        config = load_arm(self, s.manipulator, s.preset)
        with told_by(self, "pose"):
            self._config = starting_at(config, s.pose)
        self._call, self._doing = None, ""
        with told_by(self, "signal", "band", "resolution", "ignore"):
            self._test = self._planned(s)
        self._names = tuple(config.actuated)
        self._theta, self._theta_dot = self._config.home.copy(), np.zeros(len(self._names))
        self._models: PendingModels[str] = PendingModels()
        self._model_id, self._sequence, self._now_ns = "", 0, -1
        self._guard = GuardStatus()
        self._waiting: JointState | None = None  # a state that nobody has answered
        first = (self._wait_for_partners, self._look_around, self._arm, self._wait_for_arming)
        steps = (*first, self._wait_for_end, self._stop, self._wait_for_stop)
        self._series = Series(steps, s.patience, time.monotonic())
        self._connect()

    def _planned(self, settings: ExciteSettings) -> LiveTest:
        try:
            arm = HeldArm(self._config)
            plan = plan_excitation(arm, wish_of(settings))
            return LiveTest(arm, plan, settings.ignore, self._say, settings.lockstep)
        except ValueError as error:
            raise ParameterError(str(error)) from error

    def _say(self, doing: str) -> None:
        self._doing = doing  # what it begins with is told when the arm is armed
        if self._call is not None:
            self.get_logger().info(doing)

    @property
    def outcome(self) -> str | None:
        """None while the test goes on, "" when it is done, else why not."""
        return self._series.outcome

    @property
    def is_finished(self) -> bool:
        """Whether the test is over, or cannot be."""
        return self._series.is_over

    def stop(self) -> None:
        """Stop the arm if it is still held; say why the test did not come to its end."""
        self._series.end("interrupted")
        self.exit_code = 1 if self.outcome else 0
        if self.outcome:
            self._halt.publish(Empty())
            print(f"excite: {self.outcome}", file=sys.stderr)
        self._test.close()
        for outlet in (self._halt, self._told):
            outlet.wait_for_all_acked(Duration(seconds=ACKNOWLEDGED))

    def on_look(self) -> None:
        """Take the next step if it can be taken."""
        others = self._other_commanders()
        if others:
            self._series.end(
                f"{', '.join(others)} may publish {COMMANDS}: nothing is excited while a controller is "
                "active; ros2 lifecycle set /flexarm/controller deactivate"
            )
        self._series.look(time.monotonic())

    def _wait_for_partners(self) -> bool:
        also = "" if self.settings.lockstep or self._now_ns >= 0 else "joint_states"
        return self._partners.are_ready(self._series.waited(time.monotonic()), also)

    def _look_around(self) -> bool:
        """Refuse to pull an arm that stands elsewhere; a controller becomes known meanwhile."""
        if self._guard.session_token:
            raise SeriesError("the guard is armed: somebody else moves the arm; stop it with guard/stop")
        if abs(self._theta - self._config.home).max() > AT_POSE:
            at = ", ".join(f"{value:.4f}" for value in self._theta)
            raise SeriesError(f"the arm does not stand at its pose; to test it where it is: pose:=[{at}]")
        is_over = self._series.waited(time.monotonic()) > LOOKED_AROUND
        if is_over and self.count_publishers(self.resolve_topic_name(COMMANDS)) > 1:
            raise SeriesError(f"somebody without a name may publish {COMMANDS}")
        return is_over

    def _arm(self) -> bool:
        return self._called("arm")

    def _wait_for_arming(self) -> bool:
        is_armed = bool(self._guard.mode == GuardStatus.ARMED)
        if not is_armed and self._call.done() and not self._call.result().success:
            raise SeriesError(f"guard refused to arm: {self._call.result().message}")
        if is_armed:
            self.get_logger().info(self._doing)
        return is_armed

    def _wait_for_end(self) -> bool:
        if not self._test.has_ended and self._guard.mode != GuardStatus.ARMED:
            raise SeriesError(f"guard stopped the arm: {self._guard.reason}")
        return self._test.has_ended

    def _stop(self) -> bool:
        if self._test.told is not None:
            self._told.publish(String(data=to_text(self._test.told)))
        return self._called("stop")

    def _wait_for_stop(self) -> bool:
        if (is_stopped := bool(self._guard.mode == GuardStatus.STOPPED)) and self._test.failure:
            raise SeriesError(self._test.failure)
        return is_stopped

    def _called(self, name: str) -> bool:
        """Call a trigger of the guard; returns whether it is there."""
        client = self._triggers[name]
        if not client.service_is_ready():
            return False
        self._call = client.call_async(Trigger.Request())
        return True

    def _other_commanders(self) -> list[str]:
        """Return the names of other nodes that publish commands; one that is just appearing has none yet."""
        found = self.get_publishers_info_by_topic(self.resolve_topic_name(COMMANDS))
        return sorted({info.node_name for info in found} - {self.get_name(), NAMELESS})

    def _on_joint_states(self, msg: JointState) -> None:
        """Note where the axes are; answer when the guard is armed."""
        try:
            self._theta, self._theta_dot = told_axes(msg, self._names)
        except UntoldError as error:
            if self._guard.session_token:  # what holds the arm must know where it is
                self._series.end(str(error))
            return
        self._now_ns = stamp_to_ns(msg.header.stamp)
        self._waiting = msg
        self._answer()
        self._test.on_sensor("joint_states", msg)

    def _on_guard(self, msg: GuardStatus) -> None:
        self._guard = msg
        self._answer()

    def _on_model(self, msg: ReducedModel) -> None:
        if msg.config_id != self._config.config_id:
            self._series.end(
                f"model of '{msg.manipulator}' has config {msg.config_id}, not {self._config.config_id} "
                f"(preset '{self._config.preset}'): start all with the same file and preset"
            )
        self._models.add(stamp_to_ns(msg.header.stamp), msg.model_id)

    def _answer(self) -> None:
        """Answer the newest state, once, while the guard is armed and nobody has ended the test."""
        msg, token = self._waiting, self._guard.session_token
        if msg is None or not token or self._series.is_over or self._call is None:
            return
        self._waiting, stamp_ns = None, stamp_to_ns(msg.header.stamp)
        self._model_id = self._models.due(stamp_ns) or self._model_id
        tau, added = self._test.answer(stamp_ns, self._theta, self._theta_dot)
        self._sequence += 1
        self._series.note(time.monotonic())
        command = JointCommand(sequence=self._sequence, session_token=token, model_id=self._model_id)
        command.header.stamp, command.names, command.effort = msg.header.stamp, list(self._names), floats(tau)
        self._commands.publish(command)
        self._added.publish(JointState(header=command.header, name=list(self._names), effort=floats(added)))

    def _connect(self) -> None:
        quality, heard = (LOCKSTEP_QOS,) * 2 if self.settings.lockstep else (RELIABLE_QOS, SENSOR_QOS)
        self._commands = self.create_publisher(JointCommand, COMMANDS, quality)
        self._added = self.create_publisher(JointState, "excitation", quality)
        self._told = self.create_publisher(String, "~/test", LATCHED_QOS)
        self._halt = self.create_publisher(Empty, "stop", RELIABLE_QOS)
        self.create_subscription(ReducedModel, "model", self._on_model, MODELS_QOS)
        self.create_subscription(GuardStatus, "guard_status", self._on_guard, quality)
        self.create_subscription(JointState, "joint_states", self._on_joint_states, heard)
        self.create_subscription(JointState, TORQUE_TOPIC, self._test.on_torque, heard)
        others = [name for name in self._test.topics if not name.startswith(("joint_states", f"{CAMERA}/"))]
        for topic in others:
            kind = StrainArray if topic == "strain" else Imu
            self.create_subscription(kind, topic, partial(self._test.on_sensor, topic), heard)
        self._partners = Partners(self, self.settings.partners, self.settings.patience)
        self._triggers = {name: self.create_client(Trigger, f"guard/{name}") for name in ("arm", "stop")}
        self.create_timer(LOOK_PERIOD, self.on_look, clock=Clock(clock_type=ClockType.STEADY_TIME))


def main() -> int:
    """Run the node until its test is over."""
    return run_node(ExciteNode)
