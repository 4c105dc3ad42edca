"""Watch node: who of the graph is ready, what the guard does, and a stop when an essential process ends.

Publishes
    stop (std_msgs/Empty): the guard latches a stop.
Subscribes
    <name>/ready (std_msgs/Bool, latched) of every node, guard_status (flexarm_interfaces/GuardStatus),
    /diagnostics (diagnostic_msgs/DiagnosticArray): what the recorder cannot write, what nodes complain of.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from flexarm_interfaces.msg import GuardStatus
from rclpy.node import Node
from std_msgs.msg import Bool, Empty

from flexarm_bringup.processes.graph import Process
from flexarm_bringup.processes.secured import WATCH, WATCH_ENCLAVE
from flexarm_bringup.processes.spinning import spin_once
from flexarm_bringup.rig_run.late_nodes import Complaints
from flexarm_model.process.leaving import LEAVING, ends_within
from flexarm_model.ros.node import LATCHED_QOS, LATEST_QOS, RELIABLE_QOS, events_executor
from flexarm_model.ros.tool_node import in_domain

ARM, STOP = "flexarm arm", "flexarm stop"
RECORDER = "flexarm/recorder"  # name of its status
_MODES = {GuardStatus.STOPPED: "stopped", GuardStatus.ARMED: "armed", GuardStatus.BRAKING: "braking"}


@contextmanager
def watching(names: Sequence[str], say: Callable[[str], None]) -> Iterator[WatchNode]:
    """Watch nodes from inside a program; signals are left to it.

    Raises:
        SecurityError: Security is asked for and cannot be had.
    """
    with in_domain(WATCH_ENCLAVE):
        node = WatchNode(names, say)
        try:
            yield node
        finally:
            node.end()


class WatchNode(Node):  # type: ignore[misc]
    """Hears the graph.

    Attributes:
        ready: Whether each node is ready, by name.
        complaints: What nodes say is wrong with them.
        exit_code: With which the process ends by itself if it cannot leave the graph; say when it is known.
    """

    def __init__(self, names: Sequence[str], say: Callable[[str], None]) -> None:
        """Subscribe.

        Args:
            names: Nodes of the graph.
            say: Told every change in one line.
        """
        super().__init__(WATCH, namespace="flexarm", start_parameter_services=False)
        self.ready = dict.fromkeys(names, False)
        self.complaints = Complaints()
        self.exit_code = 1
        self._say, self._guard, self._recorder = say, "", ""
        self._stop = self.create_publisher(Empty, "stop", RELIABLE_QOS)
        for name in names:
            self.create_subscription(
                Bool, f"{name}/ready", lambda msg, name=name: self.on_ready(name, msg.data), LATCHED_QOS
            )
        self.create_subscription(GuardStatus, "guard_status", self.on_guard_status, LATEST_QOS)
        self.create_subscription(DiagnosticArray, "/diagnostics", self.on_diagnostics, RELIABLE_QOS)
        self._executor = events_executor()
        self._executor.add_node(self)

    @property
    def all_ready(self) -> bool:
        """Whether every process is."""
        return all(self.ready.values())

    def spin(self, seconds: float) -> None:
        """Hear what comes within a short time."""
        spin_once(self._executor, seconds)

    def end(self) -> None:
        """Leave the graph."""
        with ends_within(LEAVING, self.exit_code):
            self._executor.shutdown()
            self.destroy_node()

    def on_ready(self, name: str, is_ready: bool) -> None:
        """Tell a change."""
        if is_ready == self.ready[name]:
            return
        self.ready[name] = is_ready
        self._say(f"{name} {'ready' if is_ready else 'not ready any more'}")
        if is_ready and self.all_ready:
            self._say(f"all ready; to let commands pass: {ARM}; to stop: {STOP}")

    def on_guard_status(self, msg: GuardStatus) -> None:
        """Tell a change."""
        told = f"guard: {_MODES[msg.mode]}{': ' if msg.reason else ''}{msg.reason}"
        if told != self._guard:
            self._guard = told
            self._say(told)

    def on_diagnostics(self, msg: DiagnosticArray) -> None:
        """Keep complaints; tell once that the recorder has failed: the motion goes on without it."""
        for status in msg.status:
            is_well = status.level == DiagnosticStatus.OK
            self.complaints.hear(status.name, status.message, is_well=is_well)
            is_error = status.name == RECORDER and status.level == DiagnosticStatus.ERROR
            if is_error and status.message != self._recorder:
                self._recorder = status.message
                self._say(f"recorder: {status.message}")

    def stop_motion(self, process: Process) -> None:
        """Stop the motion when an essential process has ended; may be called from any thread."""
        if process.essential:
            self._stop.publish(Empty())

    def on_ending(self, process: Process) -> None:
        """Stop the motion when an essential process has ended; forget that it was ready."""
        self.stop_motion(process)
        self.ready.update(dict.fromkeys(process.nodes, False))
