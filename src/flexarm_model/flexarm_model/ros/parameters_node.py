"""Topics of the named parameters of an arm: one each, of the message that is usual for what it is.

A parameter ``pressure: 2 bar`` is heard on ``parameters/pressure``.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from functools import partial
from typing import Any

from rclpy.node import Node
from sensor_msgs.msg import FluidPressure
from std_msgs.msg import Float64

from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.ros.node import RELIABLE_QOS

Heard = Callable[[str, float, float], None]  # name, value [SI], variance; 0: unknown


def message_types(config: ManipulatorConfig) -> dict[str, type[Any]]:
    """Return the type of the messages of every parameter that an axis follows, by name."""
    return {law.parameter: FluidPressure if law.dimension == "pressure" else Float64 for law in config.laws}


def subscribe_parameters(
    node: Node, config: ManipulatorConfig, heard: Heard, folder: str = "parameters"
) -> Callable[[], str]:
    """Hear the parameters of an arm.

    Args:
        node: Hears.
        config: The arm.
        heard: Takes what is told.
        folder: Before the names of the topics.

    Returns:
        What tells of whom nothing is heard who should be: empty where nobody ever spoke, or all have.
    """
    spoken: set[str] = set()
    topics = {name: node.resolve_topic_name(f"{folder}/{name}") for name in message_types(config)}
    for name, kind in message_types(config).items():
        node.create_subscription(kind, topics[name], partial(_hear, heard, spoken, name), RELIABLE_QOS)

    def silence() -> str:
        """Say which publishers are silent, or gone."""
        there = {name: node.count_publishers(topic) > 0 for name, topic in topics.items()}
        return "; ".join(
            _silence(topics[name], there[name], name in spoken) for name in silent(there, spoken)
        )

    return silence


def silent(there: Mapping[str, bool], spoken: Collection[str]) -> list[str]:
    """Return the parameters of which nothing is heard though somebody publishes them, or does not any more.

    Args:
        there: Whether somebody publishes them, by name.
        spoken: Those of which something was heard.
    """
    return [name for name, is_there in there.items() if is_there != (name in spoken)]


def _silence(topic: str, is_there: bool, has_spoken: bool) -> str:
    if has_spoken and not is_there:
        return f"nobody publishes {topic} any more; what was told last is used"
    return f"nothing was heard on {topic} yet; the described value is used"


def parameter_msg(kind: type[Any], value: float, stamp: Any) -> Any:
    """Return the message of a parameter, without a variance.

    Args:
        kind: Its type.
        value: [SI].
        stamp: Time message.
    """
    if kind is Float64:
        return Float64(data=value)
    msg = FluidPressure(fluid_pressure=value)
    msg.header.stamp = stamp
    return msg


def _hear(heard: Heard, spoken: set[str], name: str, msg: Any) -> None:
    spoken.add(name)
    if isinstance(msg, Float64):
        heard(name, msg.data, 0.0)
    else:
        heard(name, msg.fluid_pressure, msg.variance)
