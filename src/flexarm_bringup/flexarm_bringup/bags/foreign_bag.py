"""A bag of another robot through the estimator: topics are renamed, what could not be used is counted.

Such a bag holds neither a description nor a model, so both are those of the manipulator that is asked for.
Whatever the robot was, no message may stop the estimator; it says what it ignored, and why.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from flexarm_bringup.bags.bag_reader import Bag
from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.conversions import deserialise
from flexarm_bringup.topics import NAMESPACE, find_stream
from flexarm_estimator.estimate import SensorReport
from flexarm_estimator.exchange import EstimatorExchange
from flexarm_estimator.messages.inbox import TORQUE_TOPIC
from flexarm_estimator.messages.sensor_messages import SensorReader
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.conversions import model_to_msg, stamp_to_ns
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

TRIGGER = "joint_states"
SEPARATOR = ":="


@dataclass(frozen=True)
class Fed:
    """What became of a foreign bag.

    Attributes:
        used: Messages handed to the estimator, by topic of the bag.
        unused: Messages of the other topics.
        statuses: Estimates by status.
        ignored: Refusals by sensor or topic and reason.
        sensors: Health of every sensor at the end.
    """

    used: Mapping[str, int]
    unused: Mapping[str, int]
    statuses: Mapping[str, int]
    ignored: Mapping[str, Mapping[str, int]]
    sensors: tuple[SensorReport, ...]


def read_remaps(texts: Sequence[str]) -> dict[str, str]:
    """Return topics of the estimator by topic of the bag.

    Args:
        texts: Each "/topic/of/the/bag:=topic", as ROS writes it.

    Raises:
        BagError: One is not written like that, or a topic is given two.
    """
    remaps: dict[str, str] = {}
    for text in texts:
        source, separator, target = text.partition(SEPARATOR)
        if not (source and separator and target):
            raise BagError(f"remap: '{text}' is not FROM:=TO, as in /joint_states:=joint_states")
        if remaps.get(source, target) != target:
            raise BagError(
                f"remap: {source} is fed as '{remaps[source]}' and as '{target}'; expected one of them"
            )
        remaps[source] = target
    return remaps


def feed_bag(
    bag: Bag, remaps: Mapping[str, str], config: ManipulatorConfig, settings: EstimatorConfig
) -> Fed:
    """Feed the estimator of a manipulator with a bag of another robot.

    Args:
        bag: The bag.
        remaps: Topics of the estimator, relative, by absolute topic of the bag.
        config: The manipulator.
        settings: Of the estimator.

    Raises:
        BagError: A topic is not in the bag, not one of the estimator's, or of another type.
    """
    _check_remaps(bag, remaps, (*SensorReader(config).topics, TORQUE_TOPIC))
    exchange = EstimatorExchange(config, settings, None)
    exchange.on_model(model_to_msg(linearize(ReducedTree(config))))
    used: Counter[str] = Counter()
    statuses: Counter[str] = Counter()
    for record in bag.records:
        topic = remaps.get(record.name)
        if topic is None:
            continue
        used[record.name] += 1
        msg: Any = deserialise(record.cdr, record.type)
        exchange.on_sensor(topic, msg)
        if topic == TRIGGER and exchange.step(stamp_to_ns(msg.header.stamp)) and exchange.estimate:
            statuses[exchange.estimate.status] += 1
    unused = {name: count for name, count in bag.counts.items() if name not in remaps}
    sensors = exchange.estimate.sensors if exchange.estimate else ()
    return Fed(used, unused, statuses, exchange.refusals(), sensors)


def _check_remaps(bag: Bag, remaps: Mapping[str, str], allowed: Sequence[str]) -> None:
    types = {record.name: record.type for record in bag.records}
    for source, target in remaps.items():
        if source not in types:
            raise BagError(f"{bag.path}: no message on {source}; it has {', '.join(sorted(types))}")
        if target not in allowed:
            raise BagError(f"remap: the estimator reads no '{target}'; allowed: {', '.join(allowed)}")
        stream = find_stream(f"{NAMESPACE}/{target}")
        if stream is not None and stream.type != types[source]:
            raise BagError(f"{bag.path}: {source} has type {types[source]}, {target} needs {stream.type}")
