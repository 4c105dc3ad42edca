"""Verdicts on /diagnostics once a second, from any node.

All arms of a domain share the topic. What a node outside of ``/flexarm`` says bears its namespace ahead of
name and hardware, "left/guard: commands": who keeps the newest status of every name would take one arm's for
another's.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from flexarm_model.conversions import verdict_to_msg
from flexarm_model.process.executable import NAMESPACE
from flexarm_model.ros.node import RELIABLE_QOS
from flexarm_model.settings.diagnosis import Verdict

PERIOD = 1.0  # s


class DiagnosticsOutlet:
    """The /diagnostics of a node."""

    def __init__(self, node: Node) -> None:
        """Publish as this node."""
        self._publisher = node.create_publisher(DiagnosticArray, "/diagnostics", RELIABLE_QOS)
        space = node.get_namespace().strip("/")
        self._ahead = f"{space}/" if space not in ("", NAMESPACE) else ""

    def publish(self, array: DiagnosticArray) -> None:
        """Publish statuses, which are given the namespace of their arm."""
        for status in array.status if self._ahead else ():
            status.name, status.hardware_id = self._ahead + status.name, self._ahead + status.hardware_id
        self._publisher.publish(array)


class Diagnostics:
    """Asks a node for its verdicts once a second of wall time and publishes them."""

    def __init__(self, node: Node, verdicts: Callable[[], Iterable[Verdict]]) -> None:
        """Begin; ``verdicts`` judges the last second."""
        self._node, self._verdicts = node, verdicts
        self._outlet = DiagnosticsOutlet(node)
        wall = Clock(clock_type=ClockType.STEADY_TIME)
        self._timer = node.create_timer(PERIOD, self.publish, clock=wall)

    def publish(self) -> None:
        """Tell the verdicts now."""
        name = self._node.get_name()
        array = DiagnosticArray(status=[verdict_to_msg(verdict, name) for verdict in self._verdicts()])
        array.header.stamp = self._node.get_clock().now().to_msg()
        self._outlet.publish(array)
