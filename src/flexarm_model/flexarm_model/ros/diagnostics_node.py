"""Verdicts on /diagnostics once a second, from any node."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from flexarm_model.conversions import verdict_to_msg
from flexarm_model.ros.node import RELIABLE_QOS
from flexarm_model.settings.diagnosis import Verdict

PERIOD = 1.0  # s


class Diagnostics:
    """Asks a node for its verdicts once a second of wall time and publishes them."""

    def __init__(self, node: Node, verdicts: Callable[[], Iterable[Verdict]]) -> None:
        """Begin; ``verdicts`` judges the last second."""
        self._node, self._verdicts = node, verdicts
        self._publisher = node.create_publisher(DiagnosticArray, "/diagnostics", RELIABLE_QOS)
        wall = Clock(clock_type=ClockType.STEADY_TIME)
        self._timer = node.create_timer(PERIOD, self.publish, clock=wall)

    def publish(self) -> None:
        """Tell the verdicts now."""
        name = self._node.get_name()
        array = DiagnosticArray(status=[verdict_to_msg(verdict, name) for verdict in self._verdicts()])
        array.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(array)
