"""What every node shares: its life, its parameters, its quality of service, its readiness.

A node file reads ``def main() -> int: return run_node(EstimatorNode)``. The executor is the events executor
where rclpy has it (65-80 us per callback however many entities there are). Its ``spin`` never returns on a
signal and rclpy's own handlers may hang at shutdown, hence the loop of ``spin_once`` and the handlers here.
"""

from __future__ import annotations

import gc
import signal
import sys
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any

import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.executors import ExternalShutdownException
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import Bool

from flexarm_model.process.announce import announce_on_stderr
from flexarm_model.process.executable import EXIT_CONFIGURATION, EXIT_NAME_TAKEN, STOPPING
from flexarm_model.process.heap import give_back_large_buffers
from flexarm_model.process.leaving import LEAVING, end_within
from flexarm_model.process.loading import Loading
from flexarm_model.process.process_title import set_process_title
from flexarm_model.process.punctual import raise_priority, stay_on
from flexarm_model.process.security import (
    SecurityError,
    check_security,
    is_security_asked_for,
    told_of_security,
)
from flexarm_model.process.single_instance import NameTakenError, claim_name
from flexarm_model.process.start_watch import StartWatch
from flexarm_model.ros.alarm import Alarm
from flexarm_model.ros.logger_node import FastLogging
from flexarm_model.ros.parameter_file import parameter_sources, refuse_stray
from flexarm_model.settings.parameters import ParameterError
from flexarm_model.settings.strict_yaml import ConfigError

SENSOR_QOS = QoSProfile(depth=50, reliability=ReliabilityPolicy.BEST_EFFORT)
RELIABLE_QOS = QoSProfile(depth=10)
# of every period, for who records them: what his socket had no room for he asks for after 0.1 s (fastdds.xml)
PERIODIC_QOS = QoSProfile(depth=100)
LATEST_QOS = QoSProfile(depth=1)
# of every period: what is lost is too old when it has been sent again, and acknowledging costs each one more
NEWEST_QOS = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
LATCHED_QOS = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
TOLD_QOS = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)  # each is of another thing
GOALS_QOS = QoSProfile(depth=20, durability=DurabilityPolicy.TRANSIENT_LOCAL)  # their end is said once
MODELS_DEPTH = 500  # most models of one motion; they are sent in one go, ahead of it
MODELS_QOS = QoSProfile(depth=MODELS_DEPTH, durability=DurabilityPolicy.TRANSIENT_LOCAL)
LOCKSTEP_QOS = QoSProfile(depth=1000)  # both ends in lockstep: no message is lost while a reader is slow

SPIN_TIMEOUT = 0.1  # s; longest delay of a stop by signal
READY_PERIOD = 0.05  # s
LAST_WORDS = 0.2  # s in which who asked a node to end hears the answer: words of one that is gone are dropped

_CONFIGURATION_ERRORS = (
    ParameterError,
    ConfigError,
    SecurityError,
    rclpy_implementation.RCLError,  # parameter file or security settings that rcl refuses
    rclpy_implementation.UnknownROSArgsError,
)


def run_node(factory: Callable[[], FastLogging]) -> int:
    """Run a node until SIGINT or SIGTERM and take it down in order.

    A node may have a method ``stop``, called before anything is destroyed (safe state, open files);
    ``companions``, nodes that share its executor and its life; an ``alarm`` that is looked at after every
    message; ``is_finished``, true when it ends by itself; and ``exit_code``.

    Args:
        factory: Makes the node, whose lines must not stop it; may raise ParameterError or ConfigError.

    Returns:
        Exit code: 0, or the node's own; with one line on stderr 2 when the configuration is wrong, and 3
        when a node of the same name is running. One that hangs while it starts ends with 4 (``StartWatch``).
    """
    watch = StartWatch()
    try:
        return _run(factory, watch)
    finally:
        watch.end()


def _run(factory: Callable[[], FastLogging], watch: StartWatch) -> int:
    announce_on_stderr()
    give_back_large_buffers()
    for number in STOPPING:
        signal.signal(number, signal.SIG_DFL)  # before anything moves a signal ends the process at once
    try:
        check_security(sys.argv)  # also where it was not started by ``run_executable``
        expect_refusals()
        refuse_stray(sys.argv)
        parameter_sources(sys.argv)  # files are told wrong by us, before rcl does or does not
        _open_ros()
        node = factory()
        held = getattr(node, "name_held", None) or claim_name(
            node.get_fully_qualified_name(), str(node.context.get_domain_id())
        )
    except (*_CONFIGURATION_ERRORS, NameTakenError) as error:
        print(f"{factory.__name__}: {told_of_security(str(error))}", file=sys.stderr)
        rclpy.try_shutdown()
        return EXIT_NAME_TAKEN if isinstance(error, NameTakenError) else EXIT_CONFIGURATION
    names = [each.get_name() for each in (node, *getattr(node, "companions", ()))]
    set_process_title(f"flexarm:{'+'.join(names)}")
    stopping: list[int] = []
    for number in STOPPING:
        signal.signal(number, lambda received, _frame: stopping.append(received))
    with held:
        _spin(node, stopping, watch)
    for number in STOPPING:
        signal.signal(number, signal.SIG_IGN)  # who asks again would hit Python while it ends
    return int(getattr(node, "exit_code", 0))


def _open_ros() -> None:
    """Begin with ROS.

    Raises:
        RCLError: It refuses the command line, the security settings or the place of its log files.
        ConfigError: The place of its log files is there and cannot be written.
    """
    try:
        rclpy.init(args=sys.argv, signal_handler_options=SignalHandlerOptions.NO)
    except rclpy_implementation.RCLError:
        raise
    except RuntimeError as error:  # of the library that writes the log files, as it is
        raise ConfigError(f"{error}; ROS_LOG_DIR chooses a folder for log files") from error


def expect_refusals() -> None:
    """Let one line tell that security cannot be had: rclpy also warns that what it refused cannot end."""
    if is_security_asked_for():
        warnings.filterwarnings("ignore", "Failed to fini", RuntimeWarning)


class ReadyFlag:
    """Latched ``~/ready`` (std_msgs/Bool): false at first, true once all conditions hold."""

    def __init__(
        self,
        node: Node,
        conditions: Mapping[str, Callable[[], bool]],
        publisher: Any = None,
        libraries: Sequence[str] = (),
    ) -> None:
        """Start checking at 20 Hz of wall time.

        Args:
            node: The node that becomes ready.
            conditions: Each by the name that is logged while it keeps the node waiting.
            publisher: Of ~/ready; None makes one.
            libraries: Modules to load once all conditions hold, and before this is told.
        """
        self._node = node
        self._conditions, self._libraries = dict(conditions), libraries
        self._loading: Loading | None = None
        self._publisher = publisher or node.create_publisher(Bool, "~/ready", LATCHED_QOS)
        self._publisher.publish(Bool(data=False))
        wall = Clock(clock_type=ClockType.STEADY_TIME)
        self._timer = node.create_timer(READY_PERIOD, self._check, clock=wall)
        self.is_ready = False

    def waiting_for(self) -> list[str]:
        """Return the names of the conditions that do not hold now."""
        return [name for name, holds in self._conditions.items() if not holds()]

    def withdraw(self) -> None:
        """Tell that the node is not ready any more, for good."""
        self._timer.cancel()
        self.is_ready = False
        self._publisher.publish(Bool(data=False))

    def _check(self) -> None:
        waiting = self.waiting_for()
        if waiting:
            self._node.get_logger().info(f"waiting for {', '.join(waiting)}", throttle_duration_sec=5.0)
            return
        if not self._is_loaded():
            return
        self.is_ready = True
        self._timer.cancel()
        self._publisher.publish(Bool(data=True))
        self._node.get_logger().info("ready")

    def _is_loaded(self) -> bool:
        """Begin to load the libraries if that has not been done; return whether they are there."""
        if self._loading is None and self._libraries:
            self._loading = Loading(self._libraries)
        return self._loading is None or self._loading.is_done


def _spin(node: Node, stopping: list[int], watch: StartWatch) -> None:
    executor, companions = events_executor(), getattr(node, "companions", ())
    try:
        for each in (node, *companions):
            executor.add_node(each)
        gc.collect()
        gc.freeze()  # a later full collection would stop the node for 30-50 ms
        _keep_time(node)
        alarm = getattr(node, "alarm", Alarm(lambda: None, time.monotonic))
        with suppress(ExternalShutdownException):
            executor.spin_once(timeout_sec=0.0)
            watch.end()
            while not (stopping or any(getattr(each, "is_finished", False) for each in (node, *companions))):
                executor.spin_once(timeout_sec=alarm.wait(SPIN_TIMEOUT))
                alarm.look()
        if not stopping:
            time.sleep(LAST_WORDS)
    finally:
        for each in (node, *companions):
            getattr(each, "stop", lambda: None)()
        end_within(LEAVING, int(getattr(node, "exit_code", 0)))  # all of it: Python's own end, too
        executor.shutdown()
        for each in (node, *companions):
            each.destroy_node()
        rclpy.try_shutdown()


def _keep_time(node: Node) -> None:
    """Give the process the cores and the priority of its node, where it asks for them and the user may."""
    settings = getattr(node, "settings", None)
    cores, priority = getattr(settings, "cores", ()), getattr(settings, "realtime_priority", 0)
    for refusal in (stay_on(cores), raise_priority(priority)):
        if refusal:
            node.get_logger().info(refusal)


def events_executor() -> Any:
    """Return the executor of flexarm's nodes: events where rclpy has it, else single-threaded."""
    try:
        from rclpy.experimental.events_executor import EventsExecutor
    except ImportError:  # rclpy before 7.1.4
        from rclpy.executors import SingleThreadedExecutor

        return SingleThreadedExecutor()
    return EventsExecutor()
