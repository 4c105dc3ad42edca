"""Subscriptions that hear whoever speaks: reliable where that is offered, else best effort.

Who writes down everything is better off with reliable ones, for what he had no room for is sent again. But
those hear nothing of a publisher that offers best effort, as the driver of a rig may.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy

LOOK_PERIOD = 0.05  # s in which a subscription that hears nothing is replaced


class AsOffered:
    """Subscribes on behalf of a node, and again where a publisher offers less than was asked for."""

    def __init__(self, node: Node) -> None:
        """Watch over nothing yet; no subscription is replaced within its own callback."""
        self._node = node
        self._unheard: dict[str, Callable[[], None]] = {}
        node.create_timer(LOOK_PERIOD, self.look, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def subscribe(self, kind: Any, topic: str, receive: Callable[[bytes], None], quality: QoSProfile) -> None:
        """Receive the serialised messages of a topic.

        Args:
            kind: Class of the messages.
            topic: Its name.
            receive: Called with every message.
            quality: Depth and durability, and the reliability to begin with.
        """
        lesser = QoSProfile(
            depth=quality.depth, durability=quality.durability, reliability=ReliabilityPolicy.BEST_EFFORT
        )
        made: list[Any] = []

        def replace() -> None:
            """Subscribe again as best effort."""
            self._node.destroy_subscription(made.pop())
            self._node.create_subscription(kind, topic, receive, lesser, raw=True)

        def on_lesser_offer(_: Any) -> None:
            """Note that somebody offers less."""
            if made:  # an event of one that is replaced may come late
                self._unheard[topic] = replace

        events = SubscriptionEventCallbacks(incompatible_qos=on_lesser_offer)
        made.append(
            self._node.create_subscription(kind, topic, receive, quality, raw=True, event_callbacks=events)
        )

    def has_all(self) -> bool:
        """Tell whether no subscription waits to be replaced."""
        return not self._unheard

    def look(self) -> None:
        """Replace the subscriptions that hear nothing of somebody."""
        for topic in list(self._unheard):
            self._unheard.pop(topic)()
            self._node.get_logger().info(f"{topic}: heard best effort, as it is offered")
