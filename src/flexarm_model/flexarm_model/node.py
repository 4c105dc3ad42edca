"""What every node shares: its life, its parameters, its quality of service, its readiness.

A node file reads ``def main() -> int: return run_node(EstimatorNode)``. The executor is the
events executor where rclpy has it (65-80 us per callback however many entities there are). Its
``spin`` never returns on a signal and rclpy's own handlers may hang at shutdown, hence the loop of
``spin_once`` and the handlers here.
"""

from __future__ import annotations

import gc
import math
import os
import signal
import sys
from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

import rclpy
from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.clock import Clock, ClockType
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import Bool

from flexarm_model.announce import announce_on_stderr
from flexarm_model.overrides import apply_overrides
from flexarm_model.parameters import ParameterError
from flexarm_model.single_instance import NameTakenError, claim_name
from flexarm_model.strict_yaml import ConfigError

SENSOR_QOS = QoSProfile(depth=50, reliability=ReliabilityPolicy.BEST_EFFORT)
RELIABLE_QOS = QoSProfile(depth=10)
LATEST_QOS = QoSProfile(depth=1)
LATCHED_QOS = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
MODELS_DEPTH = 500  # most models of one motion; they are sent in one go, ahead of it
MODELS_QOS = QoSProfile(depth=MODELS_DEPTH, durability=DurabilityPolicy.TRANSIENT_LOCAL)
LOCKSTEP_QOS = QoSProfile(depth=1000)  # both ends in lockstep: no message is lost while a reader is slow

EXIT_CONFIGURATION, EXIT_NAME_TAKEN = 2, 3
SPIN_TIMEOUT = 0.1  # s; longest delay of a stop by signal
READY_PERIOD = 0.05  # s

_CONFIGURATION_ERRORS = (
    ParameterError,
    ConfigError,
    rclpy_implementation.RCLError,  # parameter file or security settings that rcl refuses
    rclpy_implementation.UnknownROSArgsError,
)
_TYPES = {
    bool: Parameter.Type.BOOL,
    int: Parameter.Type.INTEGER,
    float: Parameter.Type.DOUBLE,
    str: Parameter.Type.STRING,
    (bool,): Parameter.Type.BOOL_ARRAY,
    (int,): Parameter.Type.INTEGER_ARRAY,
    (float,): Parameter.Type.DOUBLE_ARRAY,
    (str,): Parameter.Type.STRING_ARRAY,
}
_CREATED_BY_RCLPY = ("use_sim_time", "start_type_description_service", "qos_overrides.")
_INT64_MAX = 2**63 - 1

Config = TypeVar("Config")


def run_node(factory: Callable[[], Node]) -> int:
    """Run a node until SIGINT or SIGTERM and take it down in order.

    A node may have a method ``stop``, called before anything is destroyed (safe state, open files), and
    ``companions``, nodes that share its executor and its life.

    Args:
        factory: Makes the node; may raise ParameterError or ConfigError.

    Returns:
        Exit code: 0; with one line on stderr 2 when the configuration is wrong, and 3 when a node of the same
        name is running.
    """
    announce_on_stderr()
    stopping: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda received, _frame: stopping.append(received))
    try:
        rclpy.init(args=sys.argv, signal_handler_options=SignalHandlerOptions.NO)
        node = factory()
        held = claim_name(node.get_fully_qualified_name(), str(node.context.get_domain_id()))
    except (*_CONFIGURATION_ERRORS, NameTakenError) as error:
        reason = " ".join(str(error).split())
        print(f"{factory.__name__}: {reason}", file=sys.stderr)
        rclpy.try_shutdown()
        return EXIT_NAME_TAKEN if isinstance(error, NameTakenError) else EXIT_CONFIGURATION
    with held:
        _spin(node, stopping)
    return 0


def declare_config(node: Node, config_class: type[Config], complete: bool = True) -> Config:
    """Declare one read-only ROS parameter per field and return the settings as given.

    Args:
        node: Node whose overrides (parameter file, command line) are used.
        config_class: Frozen dataclass whose fields were made with ``parameters.parameter``.
        complete: Refuse overrides that nobody declared; False when more settings follow.

    Raises:
        ParameterError: A value is of the wrong type or outside its range, or a key is unknown.
    """
    given = {name: item.value for name, item in node._parameter_overrides.items() if item.value is not None}
    config = apply_overrides(config_class, given)
    hints = get_type_hints(config_class)
    for item in fields(config_class):  # type: ignore[arg-type]
        _declare(node, item.name, getattr(config, item.name), hints[item.name], item.metadata)
    if complete:
        refuse_unknown_parameters(node)
    return config


def declare_configs(node: Node) -> tuple[Any, ...]:
    """Declare the parameters of every settings class in ``node.SETTINGS`` and return the settings as given.

    Raises:
        ParameterError: See ``declare_config``.
    """
    settings = tuple(declare_config(node, kind, complete=False) for kind in node.SETTINGS)
    refuse_unknown_parameters(node)
    return settings


def refuse_unknown_parameters(node: Node) -> None:
    """Check that every parameter given to the node has been declared.

    Raises:
        ParameterError: One has not; the message lists those that exist.
    """
    known = sorted(name for name in node._parameters if not name.startswith(_CREATED_BY_RCLPY))
    for name in sorted(node._parameter_overrides):
        if name not in node._parameters and not name.startswith(_CREATED_BY_RCLPY):
            allowed = ", ".join(known)
            raise ParameterError(f"{name}: unknown parameter of {node.get_name()}; allowed: {allowed}")


class ReadyFlag:
    """Latched ``~/ready`` (std_msgs/Bool): false at first, true once all conditions hold."""

    def __init__(self, node: Node, conditions: Mapping[str, Callable[[], bool]]) -> None:
        """Start checking at 20 Hz of wall time.

        Args:
            node: The node that becomes ready.
            conditions: Each by the name that is logged while it keeps the node waiting.
        """
        self._node = node
        self._conditions = dict(conditions)
        self._publisher = node.create_publisher(Bool, "~/ready", LATCHED_QOS)
        self._publisher.publish(Bool(data=False))
        wall = Clock(clock_type=ClockType.STEADY_TIME)
        self._timer = node.create_timer(READY_PERIOD, self._check, clock=wall)
        self.is_ready = False

    def waiting_for(self) -> list[str]:
        """Return the names of the conditions that do not hold now."""
        return [name for name, holds in self._conditions.items() if not holds()]

    def _check(self) -> None:
        waiting = self.waiting_for()
        if waiting:
            self._node.get_logger().info(f"waiting for {', '.join(waiting)}", throttle_duration_sec=5.0)
            return
        self.is_ready = True
        self._timer.cancel()
        self._publisher.publish(Bool(data=True))
        self._node.get_logger().info("ready")


def _spin(node: Node, stopping: list[int]) -> None:
    executor, companions = events_executor(), getattr(node, "companions", ())
    try:
        for each in (node, *companions):
            executor.add_node(each)
        gc.collect()
        gc.freeze()  # a later full collection would stop the node for 30-50 ms
        _raise_priority(node)
        while not stopping and rclpy.ok():
            executor.spin_once(timeout_sec=SPIN_TIMEOUT)
    finally:
        stop = getattr(node, "stop", None)
        if stop is not None:
            stop()
        executor.shutdown()
        for each in (node, *companions):
            each.destroy_node()
        rclpy.try_shutdown()


def _raise_priority(node: Node) -> None:
    """Give all threads of the process the node's SCHED_FIFO priority, if it has one and the user may."""
    priority = getattr(getattr(node, "settings", None), "realtime_priority", 0)
    if not priority:
        return
    try:
        for thread in os.listdir("/proc/self/task"):
            os.sched_setscheduler(int(thread), os.SCHED_FIFO, os.sched_param(priority))
    except PermissionError:
        node.get_logger().info(
            f"realtime_priority {priority} is not permitted; running with ordinary priority"
        )


def events_executor() -> Any:
    """Return the executor of flexarm's nodes: events where rclpy has it, else single-threaded."""
    try:
        from rclpy.experimental.events_executor import EventsExecutor
    except ImportError:  # rclpy before 7.1.4
        from rclpy.executors import SingleThreadedExecutor

        return SingleThreadedExecutor()
    return EventsExecutor()


def _declare(node: Node, name: str, value: Any, hint: Any, about: Mapping[str, Any]) -> None:
    kind = (get_args(hint)[0],) if get_origin(hint) is tuple else hint
    is_empty = isinstance(value, tuple) and not value  # rclpy cannot tell the type of an empty list
    descriptor = _descriptor(name, kind, about)
    descriptor.dynamic_typing = is_empty
    default = list(value) if isinstance(value, tuple) else value
    node._parameter_overrides[name] = Parameter(name, None if is_empty else _TYPES[kind], default)
    node.declare_parameter(name, default if is_empty else _TYPES[kind], descriptor)


def _descriptor(name: str, kind: Any, about: Mapping[str, Any]) -> ParameterDescriptor:
    low, high = about["minimum"], about["maximum"]
    allowed = f"; one of {', '.join(about['choices'])}" if about["choices"] else ""
    text = f"{about['text']} [{about['unit']}]{allowed}"
    descriptor = ParameterDescriptor(name=name, description=text, type=_TYPES[kind].value, read_only=True)
    if math.isinf(low) and math.isinf(high):
        return descriptor
    if kind is float:
        descriptor.floating_point_range = [FloatingPointRange(from_value=float(low), to_value=float(high))]
    if kind is int:
        low, high = (int(max(-_INT64_MAX, min(bound, _INT64_MAX))) for bound in (low, high))
        descriptor.integer_range = [IntegerRange(from_value=low, to_value=high)]
    return descriptor
