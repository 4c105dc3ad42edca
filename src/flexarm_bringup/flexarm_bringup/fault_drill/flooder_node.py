"""Speaks as fast as it can, or with messages of ten megabytes, where nodes of the rig listen.

    python -m flexarm_bringup.fault_drill.flooder_node KIND SECONDS

prints how many messages it has sent.
"""

from __future__ import annotations

import sys
import time
from array import array
from collections.abc import Callable, Sequence
from typing import Any

import rclpy
from flexarm_interfaces.msg import JointCommand, StrainArray
from rcl_interfaces.msg import ParameterEvent
from rclpy.node import Node

from flexarm_bringup.topics import NAMESPACE
from flexarm_model.ros.node import RELIABLE_QOS

LARGE = 10_000_000  # bytes
PAUSE = 1.0  # s between two large messages
SEARCH = 3.0  # s for listeners to be found


def strains(values: int = 1) -> StrainArray:
    """Return strains of a gauge that nobody has."""
    return StrainArray(names=["nobody"], strain=array("d", bytes(8 * values)))


def command(values: int = 1) -> JointCommand:
    """Return a command without a token."""
    return JointCommand(names=["nobody"], effort=array("d", bytes(8 * values)))


KINDS: dict[str, tuple[str, Callable[[], Any], float]] = {  # topic, message, pause [s]
    "sensor": ("strain", strains, 0.0),
    "command": ("joint_commands", command, 0.0),
    "parameter": ("/parameter_events", ParameterEvent, 0.0),
    "large sensor": ("strain", lambda: strains(LARGE // 8), PAUSE),
    "large command": ("joint_commands", lambda: command(LARGE // 8), PAUSE),
}


def main(arguments: Sequence[str]) -> int:
    """Flood from here."""
    topic, make, pause = KINDS[arguments[0]]
    rclpy.init()
    node = Node("flooder", namespace=NAMESPACE, start_parameter_services=False)
    msg, sent = make(), 0
    publisher = node.create_publisher(type(msg), topic, RELIABLE_QOS)
    deadline = time.monotonic() + SEARCH
    while not publisher.get_subscription_count() and time.monotonic() < deadline:
        time.sleep(0.01)
    print(f"{publisher.get_subscription_count()} listener(s)", flush=True)
    end = time.monotonic() + float(arguments[1])
    while time.monotonic() < end:
        if hasattr(msg, "header"):
            msg.header.stamp = node.get_clock().now().to_msg()
        publisher.publish(msg)
        sent += 1
        if pause:
            time.sleep(pause)
    print(f"{sent} sent", flush=True)
    rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
