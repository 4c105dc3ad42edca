"""Refuses a simulated rig where a driver of a real one speaks already, before any process is started.

Subscribes
    drive_states, joint_states (sensor_msgs/JointState): whoever drives an arm tells them in every period.

Who is only listed in the graph of ROS may have been killed a while ago; who is heard lives. Where nodes see
this machine only and nobody else is in the domain, there is nothing to wait for.
"""

from __future__ import annotations

import os
import time
from collections.abc import Sequence

from rclpy.node import Node
from sensor_msgs.msg import JointState

from flexarm_bringup.processes.domain_ports import may_be_used
from flexarm_bringup.processes.graph import DRIVE_TOPICS, RIG, Process
from flexarm_bringup.processes.spinning import spin_once
from flexarm_bringup.topics import NAMESPACE
from flexarm_model.process.ros_arguments import domain
from flexarm_model.ros.node import SENSOR_QOS, events_executor
from flexarm_model.ros.tool_node import in_domain
from flexarm_model.settings.strict_yaml import ConfigError

LISTEN = 3.5  # s; Fast DDS announces itself every 3 s, sooner with config/middleware/fastdds.xml
_LOOK_PERIOD = 0.05  # s


class SecondDriverError(ConfigError):
    """Somebody drives the arm already; the text says who, and what to do."""


def refuse_second_driver(graph: Sequence[Process], seconds: float = LISTEN) -> None:
    """Check that nobody is the drives of an arm whose rig is to be simulated.

    Args:
        graph: What is to be started.
        seconds: To listen for, where it has a simulated rig [s].

    Raises:
        SecondDriverError: Somebody tells what drives measure.
        SecurityError: Security is asked for and cannot be had.
    """
    if all(row.name != RIG for row in graph) or _is_alone():
        return
    heard: set[str] = set()
    with in_domain():  # as a tool, which may hear everything where security is asked for
        node = Node("look", namespace=NAMESPACE, start_parameter_services=False)
        for topic in DRIVE_TOPICS:
            node.create_subscription(JointState, topic, lambda _, topic=topic: heard.add(topic), SENSOR_QOS)
        executor, end = events_executor(), time.monotonic() + seconds
        executor.add_node(node)
        while not heard and time.monotonic() < end:
            spin_once(executor, _LOOK_PERIOD)
        executor.shutdown()
        node.destroy_node()
    if heard:
        raise SecondDriverError(
            f"{min(heard)}: somebody speaks there already in ROS domain {domain(os.environ)}: end it first, "
            "or for a driver of your own leave out the simulated rig: --driver drive_states (launch: "
            "driver:=drive_states), joint_states where it tells only these"
        )


def _is_alone() -> bool:
    is_local = os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE") in ("LOCALHOST", "OFF")
    return is_local and not may_be_used(int(domain(os.environ)))
