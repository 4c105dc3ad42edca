"""Subscriptions that take messages as bytes: read in a fraction of the time, and none that is too large.

See ``message_reader``. rclpy needs 30 MB and several periods to make a message of its own of 10 MB.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message
from rclpy.subscription import Subscription

from flexarm_model.ros.message_reader import MessageReader

MOST_BYTES = 100_000  # of a message of a sensor or a command


def has_too_many_bytes(raw: bytes) -> str:
    """Return that a message of a sensor or a command is too large; empty where it is not."""
    return f"message of more than {MOST_BYTES} bytes" if len(raw) > MOST_BYTES else ""


def subscribe_bytes(  # noqa: PLR0913, what a subscription takes and why a message may be refused
    node: Node,
    kind: type,
    topic: str,
    take: Callable[[Any], None],
    quality: QoSProfile,
    refuse: Callable[[str], None] = lambda reason: None,
    too_large: Callable[[bytes], str] = has_too_many_bytes,
) -> Subscription:
    """Subscribe to a topic whose messages come often, and from anybody.

    Args:
        node: Who listens.
        kind: Class of the messages.
        topic: Relative or absolute.
        take: Called with every message.
        quality: Of the service.
        refuse: Told why one is not taken; it is logged, too.
        too_large: Tells from its bytes why one is not read; empty where it is.
    """
    reader = MessageReader(kind, partial(deserialize_message, message_type=kind))

    def on_bytes(raw: bytes) -> None:
        """Read a message, or refuse it."""
        reason = too_large(raw)
        if not reason:
            try:
                msg = reader.read(raw)
            except rclpy_implementation.RMWError:
                reason = "bytes that are no such message"
            else:
                take(msg)
                return
        refuse(reason)
        node.get_logger().warning(f"{topic}: {reason}", throttle_duration_sec=5.0)

    return node.create_subscription(kind, topic, on_bytes, quality, raw=True)
