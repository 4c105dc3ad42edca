"""Drift watch: do the modes still run at the frequency that the description says?

A node beside the estimator, so that it costs that nothing; nobody waits for it.

Publishes
    /diagnostics (diagnostic_msgs/DiagnosticArray): 1 Hz, one status per watched mode ("drift: mode_1"):
        running frequency [Hz] and damping [1] with one sigma; a warning with a proposal when it has drifted.
    ~/ready (std_msgs/Bool, latched): true once it has a model.
Subscribes
    model (flexarm_interfaces/ReducedModel, latched), joint_states (sensor_msgs/JointState: encoders),
    strain (flexarm_interfaces/StrainArray), imu/<name> (sensor_msgs/Imu),
    applied_effort (sensor_msgs/JointState: torque from its stamp on).
"""

from __future__ import annotations

from functools import partial
from typing import Any

from flexarm_interfaces.msg import ReducedModel, StrainArray
from rclpy.clock import Clock, ClockType
from sensor_msgs.msg import Imu, JointState

from flexarm_estimator.drift.conversions import drift_to_msg
from flexarm_estimator.drift.exchange import DriftExchange
from flexarm_estimator.drift.settings import DriftConfig
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.ros.declared_node import declare_configs, load_arm
from flexarm_model.ros.diagnostics_node import DiagnosticsOutlet
from flexarm_model.ros.managed_node import LifeSettings, ManagedNode
from flexarm_model.ros.node import MODELS_QOS, SENSOR_QOS, run_node
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
        self._told: set[str] = set()
        self._outlet = DiagnosticsOutlet(self)
        self.create_subscription(ReducedModel, "model", self.on_model, MODELS_QOS)
        for topic in self.exchange.topics:
            self.create_subscription(
                _TYPES.get(topic, Imu), topic, partial(self.exchange.on_sensor, topic), SENSOR_QOS
            )
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(DIAGNOSTICS_PERIOD, self.on_diagnostics, clock=steady)
        self.tell_ready({"a model that it can watch": lambda: self.exchange.watch is not None})

    def on_model(self, msg: ReducedModel) -> None:
        """Take a model, or say why not."""
        self.exchange.on_model(msg)
        if self.exchange.fault:
            self.get_logger().error(self.exchange.fault)

    def on_diagnostics(self) -> None:
        """Tell the modes; log what is new."""
        watch = self.exchange.watch
        stamp_ns = self.get_clock().now().nanoseconds
        self._outlet.publish(drift_to_msg(watch, self.exchange.fault, stamp_ns))
        alarms: dict[str, Any] = {} if watch is None else dict(watch.alarms)
        for name in sorted(set(alarms) - self._told):
            self.get_logger().warning(f"{alarms[name]}: {watch.proposal if watch else ''}")
        self._told = set(alarms)


def main() -> int:
    """Run the node."""
    return run_node(DriftNode)
