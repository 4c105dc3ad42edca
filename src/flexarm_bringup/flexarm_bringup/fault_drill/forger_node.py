"""Sends commands that nobody of the rig has sent: forged ones, and real ones once more.

    python -m flexarm_bringup.fault_drill.forger_node COUNT EFFORT...

sends forged ones only, from where it runs, and prints who listens.
"""

from __future__ import annotations

import copy
import random
import sys
import time
from collections.abc import Sequence
from typing import Any

import rclpy
from flexarm_interfaces.msg import JointCommand
from rclpy.node import Node

from flexarm_bringup.topics import NAMESPACE
from flexarm_model.ros.node import RELIABLE_QOS

PACE = 0.002  # s between two commands
SEARCH = 3.0  # s for listeners to be found


class Forger:
    """Speaks on the command topic through a node.

    Attributes:
        effort: What forged commands ask for: nothing that anybody would by chance.
    """

    def __init__(self, node: Node, effort: Sequence[float], seed: int = 1) -> None:
        """Speak through ``node``."""
        self.effort = list(effort)
        self._node, self._random = node, random.Random(seed)
        self._publisher = node.create_publisher(JointCommand, "joint_commands", RELIABLE_QOS)

    @property
    def listeners(self) -> int:
        """Number of nodes that hear it."""
        return int(self._publisher.get_subscription_count())

    def forge(self, like: Any) -> None:
        """Send a command with a token that was guessed, newer than the real one ``like``."""
        msg = copy.deepcopy(like)
        msg.session_token = self._random.getrandbits(62) + 1
        self._send(msg, like.sequence + 1)

    def outdate(self, like: Any) -> None:
        """Send a command with the right token and a sequence that has been used."""
        self._send(copy.deepcopy(like), like.sequence - self._random.randrange(10))

    def repeat(self, real: Any) -> None:
        """Send a real command once more as it is."""
        self._publisher.publish(real)

    def _send(self, msg: Any, sequence: int) -> None:
        msg.sequence, msg.effort = max(sequence, 0), self.effort
        self._publisher.publish(msg)


def main(arguments: Sequence[str]) -> int:
    """Send forged commands from here."""
    count, effort = int(arguments[0]), [float(value) for value in arguments[1:]]
    rclpy.init()
    node = Node("forger", namespace=NAMESPACE)
    forger, like = Forger(node, effort), JointCommand()
    end = time.monotonic() + SEARCH
    while not forger.listeners and time.monotonic() < end:
        time.sleep(PACE)
    for _ in range(count):
        like.header.stamp = node.get_clock().now().to_msg()
        forger.forge(like)
        time.sleep(PACE)
    print(f"{forger.listeners} listener(s)")
    rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
