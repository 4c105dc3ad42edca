"""What is published now: topics, the types of their messages, who speaks and with which quality.

A topic has the types of its publishers: what a subscriber takes it for is not what is said there.
"""

from __future__ import annotations

import time

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from flexarm_bringup.topics import find_stream

DEPTH = 50
_LOOK_PERIOD = 0.05  # s


def find_published(node: Node) -> dict[str, dict[str, list[str]]]:
    """Return the names of nodes that publish, by the type of their messages, by absolute topic."""
    found = {name: _speakers(node, name) for name, _ in node.get_topic_names_and_types()}
    return {name: kinds for name, kinds in found.items() if kinds}


def await_types(node: Node, topic: str, wait: float) -> list[str]:
    """Return the types that are published on a topic, the one that flexarm has for it first.

    Args:
        node: It looks.
        topic: Absolute name.
        wait: Longest time to look [s]; nobody published until then: no types.
    """
    stream = find_stream(topic)
    end = time.monotonic() + wait
    while time.monotonic() < end:
        if kinds := _speakers(node, topic):
            return sorted(kinds, key=lambda kind: (stream is None or kind != stream.type, kind))
        time.sleep(_LOOK_PERIOD)
    return []


def find_offered(node: Node, topic: str, kind: str) -> QoSProfile:
    """Return a quality that every publisher of the topic with messages of that type can serve."""
    infos = node.get_publishers_info_by_topic(topic)
    offers = [info.qos_profile for info in infos if info.topic_type == kind]
    is_reliable = all(offer.reliability == ReliabilityPolicy.RELIABLE for offer in offers)
    is_latched = all(offer.durability == DurabilityPolicy.TRANSIENT_LOCAL for offer in offers)
    return QoSProfile(
        depth=DEPTH,
        reliability=ReliabilityPolicy.RELIABLE if is_reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if is_latched else DurabilityPolicy.VOLATILE,
    )


def _speakers(node: Node, topic: str) -> dict[str, list[str]]:
    """Return the names of nodes that publish on a topic, by type; sorted, each once."""
    infos = node.get_publishers_info_by_topic(topic)
    kinds = sorted({info.topic_type for info in infos})
    return {kind: sorted({info.node_name for info in infos if info.topic_type == kind}) for kind in kinds}
