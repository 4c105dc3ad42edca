"""What every node of a running graph uses, asked of the graph itself; and what tools may."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import replace

from rclpy.node import Node

from flexarm_bringup.processes.second_driver_node import DriverEar
from flexarm_bringup.processes.secured import LOOK, OPERATOR, WATCH, WATCH_ENCLAVE
from flexarm_bringup.rig_run.watch_node import WatchNode, watching
from flexarm_bringup.security.idle_node import made
from flexarm_bringup.security.policy import NodeAccess
from flexarm_bringup.topics import NAMESPACE
from flexarm_model.process.security import TOOLS

PATIENCE = 120.0  # s until all nodes are ready
SETTLED = 1.0  # s without anything new
LISTENING, COMMANDING = ("echo", "monitor", "doctor"), ("call", "arm", "stop", "goto")  # nodes of tools
HALT = f"{NAMESPACE}/stop"


def access_of(
    names: Sequence[str],
    idle: Callable[[], Sequence[str]],
    failed: Callable[[], str],
    say: Callable[[str], None],
    patience: float = PATIENCE,
) -> tuple[NodeAccess, ...]:
    """Wait until the nodes are ready and nothing new appears; return what they, the watch and tools use.

    Args:
        names: Nodes in the namespace of flexarm that become ready.
        idle: Returns nodes that are made and do nothing (``idle_node``), those that have not ended.
        failed: Returns one line about a node that has ended and will not become ready; empty when none has.
        say: Told who has become ready.
        patience: How long they may take to become ready [s].

    Raises:
        ChildProcessError: One of them has ended.
        TimeoutError: They did not become ready.
    """
    end = time.monotonic() + patience
    with watching(names, say) as node:
        while missing := _missing(node, idle()):
            node.spin(0.05)
            if ended := failed():
                raise ChildProcessError(ended)
            if time.monotonic() > end:
                raise TimeoutError(f"not ready after {patience:g} s: {', '.join(missing)}")
        before: tuple[NodeAccess, ...] = ()
        while (now := tuple(_asked(node, name) for name in (*names, *idle(), WATCH))) != before:
            before = now
            for _ in range(20):
                node.spin(SETTLED / 20)
        return (*before, _look(node), *_tools(node, before, idle()))


def _missing(node: WatchNode, idle: Sequence[str]) -> list[str]:
    there = node.get_node_names()
    waiting = [name for name, is_ready in node.ready.items() if not is_ready]
    return [*waiting, *(name for name in idle if made(name) not in there)]


def _look(watch: WatchNode) -> NodeAccess:
    """Return what is heard before a simulated rig is started, by who watches it afterwards."""
    ear = DriverEar()
    try:
        return replace(_asked(watch, LOOK), shared=WATCH_ENCLAVE)
    finally:
        ear.destroy_node()


def _tools(watch: WatchNode, nodes: Sequence[NodeAccess], idle: Sequence[str]) -> list[NodeAccess]:
    """Return what tools may: listen to everything; or stop the arm, and call what nodes do not call."""
    topics = tuple(sorted({topic for node in nodes for topic in (*node.publish, *node.subscribe)}))
    offered = {service for node in nodes for service in node.reply}
    between = {service for node in nodes if node.name not in idle for service in node.request}
    services = tuple(sorted(offered - between))  # who attaches to the rig learns the secret of the drives
    told = tuple(topic for topic in topics if topic.endswith("_status"))
    found = []
    with ExitStack() as stack:
        for name in (*LISTENING, *COMMANDING):
            made_here = Node(name, namespace="flexarm", start_parameter_services=False)
            stack.callback(made_here.destroy_node)
            own = _asked(watch, name)
            if name in LISTENING:
                found.append(NodeAccess(name, own.publish, topics, own.reply, (), TOOLS))
            else:
                found.append(NodeAccess(name, (*own.publish, HALT), told, own.reply, services, OPERATOR))
    return found


def _asked(node: WatchNode, name: str) -> NodeAccess:
    def names(ask: Callable[[str, str], list[tuple[str, list[str]]]]) -> tuple[str, ...]:
        """Return names of topics or services of the node."""
        return tuple(sorted(found for found, _ in ask(name, NAMESPACE)))

    return NodeAccess(
        name,
        names(node.get_publisher_names_and_types_by_node),
        names(node.get_subscriber_names_and_types_by_node),
        names(node.get_service_names_and_types_by_node),
        names(node.get_client_names_and_types_by_node),
    )
