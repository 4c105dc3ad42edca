"""Idle node: any node of flexarm, made and never spun: it joins the graph as it would, and does nothing.

  python -m flexarm_bringup.security.idle_node commander --ros-args ...

Once it is made, a node beside it, ``idle_<name>``, tells so. It ends with who started it, and by signals.
"""

from __future__ import annotations

import signal
import sys
from collections.abc import Sequence
from importlib import import_module

import rclpy
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from flexarm_bringup.parameters_command import NODES
from flexarm_model.process.executable import STOPPING
from flexarm_model.process.life_line import hold_until_the_end, take_line


def made(name: str) -> str:
    """Return the name of the node that appears when the node of a name has been made."""
    return f"idle_{name}"


def main(arguments: Sequence[str]) -> int:
    """Make the node and wait for a signal."""
    for number in STOPPING:
        signal.signal(number, signal.SIG_DFL)
    line = take_line()
    if line is not None:
        hold_until_the_end(line)
    module, _, name = NODES[arguments[1]].partition(":")
    rclpy.init(args=list(arguments), signal_handler_options=SignalHandlerOptions.NO)
    node = getattr(import_module(module), name)()
    beside = Node(made(arguments[1]), namespace="flexarm", use_global_arguments=False)
    while node.context.ok() and beside.context.ok():
        signal.pause()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv))
