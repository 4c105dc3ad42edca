"""Drift watch: do the modes still run at the frequency that the description says?

A node beside the estimator, so that it costs that nothing; nobody waits for it.

Publishes
    /diagnostics (diagnostic_msgs/DiagnosticArray): 1 Hz, one status per watched mode ("drift: mode_1"):
        running frequency [Hz] and damping [1] with one sigma; a warning with a proposal when it has drifted;
        a warning ("drift: watch") that names sensors it goes on without, topics whose stamps leave periods
        out, or why it cannot watch.
    ~/ready (std_msgs/Bool, latched): true once it has a model.
Subscribes
    model (flexarm_interfaces/ReducedModel, latched), joint_states (sensor_msgs/JointState: encoders),
    strain (flexarm_interfaces/StrainArray), imu/<name> (sensor_msgs/Imu),
    applied_effort (sensor_msgs/JointState: torque from its stamp on),
    modal_state (flexarm_interfaces/ModalState): ten a second, health of the sensors,
    estimator/interventions (flexarm_interfaces/Intervention): channels switched off.
"""

from __future__ import annotations

from functools import partial
from typing import Any

from flexarm_interfaces.msg import Intervention, ModalState, ReducedModel, StrainArray
from rclpy.clock import Clock, ClockType
from sensor_msgs.msg import Imu, JointState

from flexarm_estimator.drift.conversions import drift_to_msg
from flexarm_estimator.drift.exchange import STATE_TOPIC, STATES, DriftExchange
from flexarm_estimator.drift.settings import DriftConfig
from flexarm_estimator.exchange import INTERVENTIONS_TOPIC
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.ros.declared_node import declare_configs, load_arm
from flexarm_model.ros.diagnostics_node import DiagnosticsOutlet
from flexarm_model.ros.managed_node import LifeSettings, ManagedNode
from flexarm_model.ros.node import MODELS_QOS, NEWEST_QOS, RELIABLE_QOS, SENSOR_QOS, run_node
from flexarm_model.settings.arm_settings import ArmSettings

DIAGNOSTICS_PERIOD = 1.0  # s
_TYPES = {"joint_states": JointState, "strain": StrainArray, "applied_effort": JointState}


class DriftNode(ManagedNode):
    """Connects a ``DriftExchange`` to topics."""

    SETTINGS = (ArmSettings, EstimatorConfig, DriftConfig, LifeSettings)

    def __init__(self) -> None:
        """Load the manipulator."""
        super().__init__("drift")
        own, self._filter, self._watched, life = declare_configs(self)
        self._config = load_arm(self, own.manipulator, own.preset)
        self.start(life)

    def activate(self) -> None:
        """Begin without a model; subscribe to the sensors."""
        self.exchange = DriftExchange(self._config, self._filter, self._watched)
        self._told, self._said, self._seen = set[str](), "", ""
        self._outlet = DiagnosticsOutlet(self)
        self.create_subscription(ReducedModel, "model", self.on_model, MODELS_QOS)
        for topic in self.exchange.topics:
            self.create_subscription(
                _TYPES.get(topic, Imu), topic, partial(self.exchange.on_sensor, topic), SENSOR_QOS
            )
        self.create_subscription(
            Intervention, INTERVENTIONS_TOPIC, self.exchange.on_intervention, RELIABLE_QOS
        )
        self._states = self.create_subscription(ModalState, STATE_TOPIC, self.exchange.on_state, NEWEST_QOS)
        self.polled = (self._states,)  # one in ten is read, and an executor would wake for each
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(DIAGNOSTICS_PERIOD, self.on_diagnostics, clock=steady)
        self.create_timer(STATES, self.on_look, clock=steady)
        self.tell_ready({"a model that it can watch": lambda: self.exchange.watch is not None})

    def on_model(self, msg: ReducedModel) -> None:
        """Take a model, or say why not."""
        self.exchange.on_model(msg)
        if self.exchange.fault:
            self.get_logger().error(self.exchange.fault)

    def on_look(self) -> None:
        """Read the newest state of the estimator."""
        taken = self._states.handle.take_message(self._states.msg_type, False)
        if taken is not None:
            self.exchange.on_state(taken[0])

    def on_diagnostics(self) -> None:
        """Tell the modes; log what is new."""
        watch = self.exchange.watch
        stamp_ns = self.get_clock().now().nanoseconds
        amiss = "; ".join(filter(None, (self.exchange.fault, self.exchange.said_of_stamps)))
        self._outlet.publish(drift_to_msg(watch, amiss, stamp_ns))
        alarms: dict[str, Any] = {} if watch is None else dict(watch.alarms)
        for name in sorted(set(alarms) - self._told):
            self.get_logger().warning(f"{alarms[name]}: {watch.proposal if watch else ''}")
        self._told = set(alarms)
        self._log_sensors(self.exchange.said_of_sensors)

    def _log_sensors(self, said: str) -> None:
        """Log which sensors are left out or doubted when that has changed and lasts."""
        before, self._seen = self._seen, said
        if before == said != self._said:
            self._said = said
            if said:
                self.get_logger().warning(said)
            else:
                self.get_logger().info("goes by all sensors again")


def main() -> int:
    """Run the node."""
    return run_node(DriftNode)
