"""The running graph: nodes, doubles, types and qualities of service that do not fit, models that differ.

As a process it prints the findings, as JSON.
"""

from __future__ import annotations

import json
import sys
import time
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import Any

from flexarm_interfaces.msg import ControllerStatus, GuardStatus, ModalState, ReducedModel
from rclpy.node import Node
from rclpy.qos import QoSCompatibility, QoSProfile, qos_check_compatible
from rclpy.time import Time
from rclpy.topic_endpoint_info import TopicEndpointInfo

from flexarm_bringup.doctor.finding import Finding, Verdict
from flexarm_bringup.doctor.message_types import End, find_mistyped
from flexarm_bringup.processes.graph import RIG, rig_graph
from flexarm_bringup.processes.spinning import spin_once
from flexarm_bringup.topics import NAMELESS, NAMESPACE, STREAMS, Stream
from flexarm_model.ros.node import LATEST_QOS, MODELS_QOS, events_executor
from flexarm_model.ros.tool_node import in_domain

LISTEN = 3.0  # s, and once more where nodes are missing
LOOK_PERIOD = 0.1  # s
EXCHANGE = 5.0  # s, longest that nodes need to take over a new model
OWN = "doctor"
_ERROR = "ERROR:"  # before each of rclpy's reasons
ALONE = "model", RIG, "guard", "estimator"  # one of each; what goes to the guard others may send, too


def look_at_graph() -> Iterator[Finding]:
    """Listen for a while and yield what runs; nothing runs is no fault.

    Raises:
        SecurityError: Security is asked for and cannot be had.
    """
    with in_domain():
        node = Node(OWN, namespace="flexarm", start_parameter_services=False)
        try:
            heard = _listen(node)
            found = _wait_for_nodes(node)
            speakers = {stream.topic: _speakers(node, stream) for stream in STREAMS}
            yield from look_at_nodes(found, speakers)
            yield from find_rivals(speakers)
            yield from _connections(node)
            yield from look_at_models(heard)
            yield from _guard(heard)
        finally:
            node.destroy_node()


def _listen(node: Node) -> dict[str, Any]:
    """Return the newest message of every topic that tells a model or the guard's mind."""
    heard: dict[str, Any] = {}
    kinds = {
        "model": (ReducedModel, MODELS_QOS), "modal_state": (ModalState, LATEST_QOS),
        "controller_status": (ControllerStatus, LATEST_QOS), "guard_status": (GuardStatus, LATEST_QOS),
    }  # fmt: skip
    for topic, (kind, quality) in kinds.items():
        node.create_subscription(kind, topic, lambda msg, topic=topic: heard.__setitem__(topic, msg), quality)
    executor = events_executor()
    executor.add_node(node)
    end = time.monotonic() + LISTEN
    while time.monotonic() < end:
        spin_once(executor, LOOK_PERIOD)
    executor.shutdown()
    return heard


def _wait_for_nodes(node: Node) -> Counter[str]:
    """Return how many nodes there are of every name; a busy machine hears of some late."""
    end = time.monotonic() + LISTEN
    while (found := _running(node)) and _missing(found) and time.monotonic() < end:
        time.sleep(LOOK_PERIOD)
    return found


def _running(node: Node) -> Counter[str]:
    names = node.get_node_names_and_namespaces()
    return Counter(name for name, space in names if space == NAMESPACE and name != OWN)


def _missing(found: Collection[str]) -> list[str]:
    return [row.name for row in rig_graph() if row.essential and row.name not in found]


def look_at_nodes(found: Mapping[str, int], speakers: Mapping[str, Sequence[str]]) -> Iterator[Finding]:
    """Yield which nodes run, twice or not at all; nothing is missing where a driver speaks for the rig.

    Args:
        found: Number of nodes by name.
        speakers: Names of nodes by topic.
    """
    if not found:
        yield Finding("ok", "graph", f"no node runs in {NAMESPACE}")
        return
    for name, count in sorted(found.items()):
        if count > 1:
            text = f"{count} nodes are called {NAMESPACE}/{name}"
            yield Finding("FAULT", "graph", text, "stop all but one: their messages mix")
    drivers = [] if RIG in found else _drivers(speakers)
    missing = [name for name in _missing(found) if not (name == RIG and drivers)]
    running = f"running: {', '.join(sorted(found))}"
    if missing:
        how_bad: Verdict = "FAULT" if RIG in found or drivers else "hint"
        yield Finding(how_bad, "graph", running, f"not running, or stuck: {', '.join(missing)}")
    else:
        yield Finding("ok", "graph", running)
    if drivers:
        text = f"{', '.join(drivers)} speaks in the place of {RIG}"
        yield Finding("hint", "graph", text, "right for a driver of your own: docs/drives.md")


def _drivers(speakers: Mapping[str, Sequence[str]]) -> list[str]:
    """Return who tells what the rig does; a name that nobody has heard yet is none."""
    topics = [stream.topic for stream in STREAMS if stream.publisher == RIG and not stream.is_optional]
    return sorted({who for topic in topics for who in speakers.get(topic, ())} - {NAMELESS})


def _speakers(node: Node, stream: Stream) -> list[str]:
    """Return who speaks on a topic of which there is one per arm; nobody for others."""
    if stream.publisher not in ALONE or stream.topic.endswith("/*"):
        return []
    return sorted(info.node_name for info in node.get_publishers_info_by_topic(stream.name))


def find_rivals(speakers: Mapping[str, Sequence[str]]) -> Iterator[Finding]:
    """Yield every topic of which two nodes think that it is theirs alone.

    Args:
        speakers: Names of nodes by topic.
    """
    for topic, names in speakers.items():
        if len(names) > 1:
            text = f"{topic}: {len(names)} speak, {', '.join(names)}"
            yield Finding("FAULT", "graph", text, "stop all but one: whoever listens takes each for the one")


def _connections(node: Node) -> Iterator[Finding]:
    """Yield every publisher and subscriber that DDS will not connect."""
    faults = 0
    for topic, _ in node.get_topic_names_and_types():
        offers = _others(node.get_publishers_info_by_topic(topic))
        wishes = _others(node.get_subscriptions_info_by_topic(topic))
        ends = ([End(info.node_name, info.topic_type) for info in infos] for infos in (offers, wishes))
        for finding in (*find_mistyped(topic, *ends), *_find_misfits(topic, offers, wishes)):
            faults += 1
            yield finding
    if not faults:
        yield Finding("ok", "quality", "every subscriber can hear every publisher of its topics")


def _others(infos: Sequence[TopicEndpointInfo]) -> list[TopicEndpointInfo]:
    return [info for info in infos if info.node_name != OWN]


def _find_misfits(
    topic: str, offers: Sequence[TopicEndpointInfo], wishes: Sequence[TopicEndpointInfo]
) -> Iterator[Finding]:
    for offer in offers:
        for wish in wishes:
            if reason := find_misfit(offer.qos_profile, wish.qos_profile):
                text = f"{topic}: {wish.node_name} gets nothing from {offer.node_name}"
                yield Finding("FAULT", "quality", text, f"make them fit: {reason}")


def find_misfit(offer: QoSProfile, wish: QoSProfile) -> str:
    """Return why a subscriber cannot hear a publisher, after rclpy; empty where it can.

    Reliability, durability, deadline, liveliness and its lease are compared.
    """
    verdict, reasons = qos_check_compatible(offer, wish)
    if verdict != QoSCompatibility.ERROR:
        return ""
    marked = (text.strip() for text in reasons.split(";"))
    found = [text.removeprefix(_ERROR).strip() for text in marked if text.startswith(_ERROR)]
    return ", ".join(text[:1].lower() + text[1:] for text in found)


def look_at_models(heard: dict[str, Any]) -> Iterator[Finding]:
    """Yield whether estimator and controller use the model that is served."""
    topics = ("model", "modal_state", "controller_status")
    ids = {topic: heard[topic].model_id for topic in topics if topic in heard}
    used = {topic: value for topic, value in ids.items() if value}
    if len(used) < 2:
        return
    if len(set(used.values())) == 1:
        yield Finding("ok", "model", f"{next(iter(used.values()))} everywhere")
        return
    text = ", ".join(f"{topic}: {value}" for topic, value in used.items())
    lasting = "model" in ids and max(map(_seconds, heard.values())) > _seconds(heard["model"]) + EXCHANGE
    if lasting:
        yield Finding("FAULT", "model", text, "start all nodes with one file and preset")
    else:
        yield Finding("hint", "model", text, "normal while a model is being exchanged; look again in 5 s")


def _seconds(msg: Any) -> float:
    return float(Time.from_msg(msg.header.stamp).nanoseconds) * 1e-9


def _guard(heard: dict[str, Any]) -> Iterator[Finding]:
    status = heard.get("guard_status")
    if status is None:
        return
    if status.mode == GuardStatus.ARMED:
        missed = f"{status.ticks_without_command} of {status.ticks} periods without a fresh command"
        yield Finding("ok", "guard", f"armed; {missed}")
    else:
        yield Finding("hint", "guard", f"not armed: {status.reason or 'stopped'}", "flexarm arm")


if __name__ == "__main__":
    json.dump([asdict(item) for item in look_at_graph()], sys.stdout)
