"""Topics of the named parameters of an arm: one each, of the message that is usual for what it is.

A parameter ``pressure: 2 bar`` is heard on ``parameters/pressure``.
"""

from __future__ import annotations

from collections.abc import Callable
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
) -> None:
    """Hear the parameters of an arm.

    Args:
        node: Hears.
        config: The arm.
        heard: Takes what is told.
        folder: Before the names of the topics.
    """
    for name, kind in message_types(config).items():
        node.create_subscription(kind, f"{folder}/{name}", partial(_hear, heard, name), RELIABLE_QOS)


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


def _hear(heard: Heard, name: str, msg: Any) -> None:
    if isinstance(msg, Float64):
        heard(name, msg.data, 0.0)
    else:
        heard(name, msg.fluid_pressure, msg.variance)
