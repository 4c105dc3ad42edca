"""What nodes hear besides when a driver of one's own runs in place of the simulated rig."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from flexarm_bringup.processes.graph import DRIVE_TOPICS, Process, with_driver
from flexarm_bringup.security.policy import NodeAccess
from flexarm_bringup.topics import NAMESPACE


def beside_driver(nodes: Sequence[NodeAccess], graph: Sequence[Process]) -> tuple[NodeAccess, ...]:
    """Return what nodes use beside the simulated rig or a driver, whichever of ``DRIVE_TOPICS`` it speaks on.

    Args:
        nodes: What they use beside the simulated rig.
        graph: The processes that were asked, by the clock.
    """
    renamed: dict[str, list[tuple[str, str]]] = {}
    for topic in DRIVE_TOPICS:
        for row in with_driver(graph, topic):
            renamed.setdefault(row.name, []).extend(row.remaps.items())
    return tuple(_with(node, renamed.get(node.name, ())) for node in nodes)


def _with(node: NodeAccess, remaps: Sequence[tuple[str, str]]) -> NodeAccess:
    heard = [f"{NAMESPACE}/{new}" for old, new in remaps if f"{NAMESPACE}/{old}" in node.subscribe]
    return replace(node, subscribe=tuple(sorted({*node.subscribe, *heard})))
