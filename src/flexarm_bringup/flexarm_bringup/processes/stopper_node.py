"""Stopper node: stops the motion from inside a process with a ROS context of its own, such as ros2 launch.

Publishes
    stop (std_msgs/Empty): the guard latches a stop.
"""

from __future__ import annotations

import sys

import rclpy
from rclpy.context import Context
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import Empty

from flexarm_bringup.processes.secured import WATCH, WATCH_ENCLAVE
from flexarm_model.process.security import check_security, with_enclave
from flexarm_model.ros.node import RELIABLE_QOS
from flexarm_model.ros.tool_node import NO_LOG_FILE


class StopperNode(Node):  # type: ignore[misc]
    """Runs in the enclave of who watches a graph."""

    def __init__(self) -> None:
        """Join the graph.

        Raises:
            SecurityError: Security is asked for and cannot be had.
        """
        arguments = with_enclave([*sys.argv[:1], *NO_LOG_FILE], WATCH_ENCLAVE)
        check_security(arguments)
        context = Context()
        rclpy.init(args=arguments, context=context, signal_handler_options=SignalHandlerOptions.NO)
        super().__init__(WATCH, namespace="flexarm", context=context, start_parameter_services=False)
        self._outlet = self.create_publisher(Empty, "stop", RELIABLE_QOS)

    def stop(self) -> None:
        """Stop the motion."""
        self._outlet.publish(Empty())
