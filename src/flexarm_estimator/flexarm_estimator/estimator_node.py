"""Estimator node: joints, modes and tip of the arm from its sensors.

Publishes
    modal_state (flexarm_interfaces/ModalState): joints, modes and disturbance with covariance and health,
        one per joint_states (in lockstep one per tick).
    end_effector (nav_msgs/Odometry): pose [m] of the tool in "base" and its twist, with covariances.
    /diagnostics (diagnostic_msgs/DiagnosticArray): 1 Hz.
    ~/interventions (flexarm_interfaces/Intervention): what the services below did, for a recorder.
    ~/steady_filter (flexarm_interfaces/SteadyFilter, latched): see ``settled_node``.
    ~/models (std_msgs/String, latched): receipt of the models taken and prepared so far.
    ~/ready (std_msgs/Bool, latched): true once it has a model and its topics are connected.
Subscribes
    model (flexarm_interfaces/ReducedModel, latched), joint_states (sensor_msgs/JointState: encoders),
    strain (flexarm_interfaces/StrainArray), imu/<name> (sensor_msgs/Imu), camera/<name>
    (geometry_msgs/PoseWithCovarianceStamped), applied_effort (sensor_msgs/JointState: torque from its
    stamp on), tick (flexarm_interfaces/Tick, lockstep only).
Services, all done between two steps, in order, or refused with the reason; switches and noise outlive a crash
    ~/reset (std_srvs/Trigger): forget the state.
    ~/set_state (flexarm_interfaces/SetState): joints [rad] or [m] and modes [kg^0.5 m] with their sigma.
    ~/toggle_sensor (flexarm_interfaces/ToggleSensor): switch a sensor off or on, or channels of it.
    ~/set_noise (flexarm_interfaces/SetNoise): sigma of a sensor, SI, or a setting of the process noise.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

from flexarm_interfaces.msg import Intervention as InterventionMsg
from flexarm_interfaces.msg import ModalState, ReducedModel, StrainArray, Tick
from flexarm_interfaces.srv import SetNoise as SetNoiseService
from flexarm_interfaces.srv import SetState as SetStateService
from flexarm_interfaces.srv import ToggleSensor as ToggleSensorService
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from rclpy.clock import Clock, ClockType
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger

from flexarm_estimator.estimator_health import EstimatorHealth
from flexarm_estimator.exchange import INTERVENTIONS_TOPIC, EstimatorExchange, Outgoing
from flexarm_estimator.interventions.conversions import known_state_from_msg
from flexarm_estimator.interventions.intervention import Intervention, InterventionError
from flexarm_estimator.interventions.kept_interventions import KeptInterventions
from flexarm_estimator.interventions.reset import Reset
from flexarm_estimator.interventions.set_noise import SetNoise
from flexarm_estimator.interventions.toggle_sensor import ToggleSensor
from flexarm_estimator.late_sensors import late_sensors
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.settled_node import SettledFilter
from flexarm_estimator.state_writer import StateWriter
from flexarm_model.conversions import stamp_to_ns, verdict_to_msg
from flexarm_model.process.ahead import made
from flexarm_model.ros.arriving_models import QUIET, ArrivingModels
from flexarm_model.ros.bytes_node import subscribe_bytes
from flexarm_model.ros.declared_node import declare_configs, load_arm
from flexarm_model.ros.diagnostics_node import DiagnosticsOutlet
from flexarm_model.ros.lockstep import Lockstep, Messages
from flexarm_model.ros.managed_node import LifeSettings, ManagedNode
from flexarm_model.ros.node import (
    LATCHED_QOS,
    LOCKSTEP_QOS,
    MODELS_QOS,
    NEWEST_QOS,
    RELIABLE_QOS,
    SENSOR_QOS,
    run_node,
)
from flexarm_model.settings.arm_settings import LoopSettings
from flexarm_model.settings.diagnosis import DiagnosticsConfig

CLOSING_TOPIC = "joint_states"  # closes a period
DIAGNOSTICS_PERIOD = 1.0  # s
AHEAD = (EstimatorExchange, EstimatorConfig, None)  # see flexarm_model.process.ahead
LIBRARIES = ("filterpy.kalman",)  # for steps with refused rows
_TYPES = {"joint_states": JointState, "strain": StrainArray, "applied_effort": JointState}
_FAMILIES = {"imu": Imu, "camera": PoseWithCovarianceStamped}
_SERVICES: tuple[tuple[type, str, Callable[[Any], Intervention]], ...] = (
    (Trigger, "reset", lambda request: Reset()),
    (SetStateService, "set_state", lambda request: known_state_from_msg(request.state)),
    (ToggleSensorService, "toggle_sensor", lambda r: ToggleSensor(r.name, r.is_on, tuple(r.channels))),
    (SetNoiseService, "set_noise", lambda request: SetNoise(request.name, tuple(request.value))),
)


class EstimatorNode(ManagedNode):
    """Connects an ``EstimatorExchange`` to topics."""

    SETTINGS = (LoopSettings, EstimatorConfig, DiagnosticsConfig, LifeSettings)

    def __init__(self) -> None:
        """Load the manipulator."""
        super().__init__("estimator")
        self.settings: LoopSettings
        self._filter: EstimatorConfig
        self.settings, self._filter, self._thresholds, life = declare_configs(self)
        self._config = load_arm(self, self.settings.manipulator, self.settings.preset)
        self._kept = KeptInterventions(self.get_fully_qualified_name(), self.get_logger().warning)
        self.start(life)

    def activate(self) -> None:
        """Begin without a state, with what services had switched and set; subscribe to the sensors."""
        config, lockstep = self._config, self.settings.lockstep
        late = late_sensors(config.sensors, self._filter)
        for text in late:
            self.get_logger().warning(text)
        self._health = EstimatorHealth(None if lockstep else 1.0 / config.rate_hz, self._thresholds, late)
        self.exchange = made(EstimatorExchange, config, self._filter, 0 if lockstep else None)
        self._kept.hand_to(self.exchange)
        writer = StateWriter(serialize_message)
        self.exchange.write_state, self.exchange.write_tip = writer.state, writer.tip
        if not lockstep:
            self.exchange.keep_time(lambda: int(self.get_clock().now().nanoseconds))
        self._lockstep = Lockstep(self.exchange.topics, self.on_tick_complete)
        self._said, self._settled = "", SettledFilter(self, 1.0 / config.rate_hz)
        self._connect()

    def take_model(self, msg: ReducedModel) -> None:
        """Take a model, to be used from its stamp on, or say why not."""
        self.exchange.on_model(msg)
        self._receipts.publish(String(data=self.exchange.receipt))
        self._settled.tell(self.exchange.estimator)
        if self.exchange.model_fault:
            self.get_logger().error(self.exchange.model_fault)

    def on_sensor(self, topic: str, msg: Any) -> None:
        """Keep a message; the joint states close a period."""
        if self.settings.lockstep:
            self._lockstep.add(topic, msg)
            return
        self.exchange.on_sensor(topic, msg)
        if topic == CLOSING_TOPIC:
            self._step(stamp_to_ns(msg.header.stamp))

    def on_tick(self, msg: Tick) -> None:
        """Note what belongs to an instant."""
        self._lockstep.announce(msg.sequence, stamp_to_ns(msg.header.stamp), msg.topics, msg.counts)

    def on_tick_complete(self, stamp_ns: int, messages: Messages) -> None:
        """Step once everything of an instant is here."""
        for topic, received in messages.items():
            for msg in received:
                self.exchange.on_sensor(topic, msg)
        self._step(stamp_ns)

    def on_diagnostics(self) -> None:
        """Tell the health of estimator, sensors and loop."""
        array = self.exchange.diagnostics(self.get_clock().now().nanoseconds)
        array.status += [verdict_to_msg(verdict, self.get_name()) for verdict in self._health.verdicts()]
        self._diagnostics.publish(array)

    def on_request(self, read: Callable[[Any], Intervention], request: Any, response: Any) -> Any:
        """Do what a service asks for; ``read`` makes an intervention of its request."""
        intervention = read(request)
        try:
            self._publish(self.exchange.intervene(intervention))
        except InterventionError as error:
            response.success, response.message = False, str(error)
        else:
            response.success, response.message = True, intervention.describe()
            self._kept.take_from(self.exchange)
            self.get_logger().info(response.message)
        return response

    def _step(self, stamp_ns: int) -> None:
        self._arriving.take_due(stamp_ns)
        began, cpu = time.perf_counter(), time.thread_time()
        if self.exchange.advance(stamp_ns):
            self._tell()
        if (estimate := self.exchange.estimate) is not None:
            self._health.note(began, time.thread_time() - cpu, estimate.sensors)
        self._arriving.work_ahead()

    def _tell(self) -> None:
        """Send the newest state to those who listen."""
        self._publish(self.exchange.tell(self._is_heard))

    def _is_heard(self, topic: str) -> bool:
        return self.settings.lockstep or self._outlets[topic].get_subscription_count() > 0

    def _publish(self, outgoing: Iterable[Outgoing]) -> None:
        for out in outgoing:
            self._outlets[out.topic].publish(out.msg)
        self._settled.tell(self.exchange.estimator)
        estimate = self.exchange.estimate
        if estimate is not None and estimate.status != self._said:
            self._said = estimate.status
            self.get_logger().info(f"{estimate.status}{': ' if estimate.reason else ''}{estimate.reason}")

    def _connect(self) -> None:
        told = LOCKSTEP_QOS if self.settings.lockstep else RELIABLE_QOS
        self._outlets = {
            "modal_state": self.create_publisher(ModalState, "modal_state", told),
            "end_effector": self.create_publisher(Odometry, "end_effector", told),
            INTERVENTIONS_TOPIC: self.create_publisher(InterventionMsg, "~/interventions", RELIABLE_QOS),
        }
        self._diagnostics = DiagnosticsOutlet(self)
        self._receipts = self.create_publisher(String, "~/models", LATCHED_QOS)
        self._arriving = ArrivingModels(self.take_model, not self.settings.lockstep)
        self.create_subscription(ReducedModel, "model", self._arriving.add, MODELS_QOS)
        for topic in self.exchange.topics:
            kind = _TYPES.get(topic) or _FAMILIES[topic.partition("/")[0]]
            take, refuse = partial(self.on_sensor, topic), partial(self._refuse, topic)
            subscribe_bytes(self, kind, topic, take, self._quality(topic), refuse)
        if self.settings.lockstep:
            self.create_subscription(Tick, "tick", self.on_tick, LOCKSTEP_QOS)
        for kind, name, read in _SERVICES:
            self.create_service(kind, f"~/{name}", partial(self.on_request, read))
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(DIAGNOSTICS_PERIOD, self.on_diagnostics, clock=steady)
        self.create_timer(QUIET, self._arriving.look, clock=steady)
        self.tell_ready(self._conditions(), LIBRARIES)

    def _quality(self, topic: str) -> QoSProfile:
        """Return how a sensor is heard; in real time periods that are over are skipped, not caught up."""
        if self.settings.lockstep:
            return LOCKSTEP_QOS
        return NEWEST_QOS if topic == CLOSING_TOPIC else SENSOR_QOS

    def _conditions(self) -> dict[str, Callable[[], bool]]:
        """Return what must hold before the node is ready; in lockstep no message may be lost."""
        conditions: dict[str, Callable[[], bool]] = {"a model": lambda: self.exchange.estimator is not None}
        wanted = (*self.exchange.topics, "tick") if self.settings.lockstep else ("joint_states",)
        for topic in wanted:
            conditions[topic] = partial(self.has_publisher, topic)
        if self.settings.lockstep:
            conditions["the controller"] = lambda: self._outlets["modal_state"].get_subscription_count() > 0
        return conditions

    def _refuse(self, topic: str, reason: str) -> None:
        self.exchange.notes.note(topic, reason)  # told on /diagnostics


def main() -> int:
    """Run the node."""
    return run_node(EstimatorNode)
