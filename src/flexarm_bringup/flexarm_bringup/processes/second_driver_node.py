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
from functools import partial

from rclpy.node import Node
from sensor_msgs.msg import JointState

from flexarm_bringup.processes.domain_ports import may_be_used
from flexarm_bringup.processes.graph import DRIVE_TOPICS, RIG, Process
from flexarm_bringup.processes.secured import LOOK, WATCH_ENCLAVE
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


class DriverEar(Node):  # type: ignore[misc]
    """Hears drives.

    Attributes:
        heard: Topics on which somebody has spoken.
    """

    def __init__(self) -> None:
        """Subscribe; the ROS domain is open."""
        super().__init__(LOOK, namespace=NAMESPACE, start_parameter_services=False)
        self.heard: set[str] = set()
        for topic in DRIVE_TOPICS:
            note = partial(self._note, topic)
            self.create_subscription(JointState, topic, note, SENSOR_QOS)

    def _note(self, topic: str, msg: JointState) -> None:
        self.heard.add(topic)


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
    with in_domain(WATCH_ENCLAVE):  # whose keys have been looked for already, where security is asked for
        ear = DriverEar()
        executor, end = events_executor(), time.monotonic() + seconds
        executor.add_node(ear)
        while not ear.heard and time.monotonic() < end:
            spin_once(executor, _LOOK_PERIOD)
        executor.shutdown()
        ear.destroy_node()
    if ear.heard:
        raise SecondDriverError(
            f"{min(ear.heard)}: somebody speaks there already in ROS domain {domain(os.environ)}: end it "
            "first, or for a driver of your own leave out the simulated rig: --driver drive_states (launch: "
            "driver:=drive_states), joint_states where it tells only these"
        )


def _is_alone() -> bool:
    is_local = os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE") in ("LOCALHOST", "OFF")
    return is_local and not may_be_used(int(domain(os.environ)))
