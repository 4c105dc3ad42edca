"""When messages were sent, as the sender's middleware has noted it: what hears them may be late itself."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import rclpy
from rclpy.executors import SingleThreadedExecutor

from flexarm_bringup.fault_drill.system_stand import stamp
from flexarm_bringup.message_class import message_class
from flexarm_bringup.processes.running_graph_node import DEEP_QOS
from flexarm_bringup.topics import NAMESPACE, find_stream

Sent = list[tuple[float, float]]
_LOOK = 0.1  # s


@contextmanager
def send_times(topic: str) -> Iterator[Sent]:
    """Note when every message of a relative topic is sent, and its stamp [s], until the end of the block.

    A node and an executor of its own: the events executor of rclpy cannot tell of a message when it was sent.

    Raises:
        KeyError: It is not a topic of flexarm.
    """
    stream = find_stream(f"{NAMESPACE}/{topic}")
    if stream is None:
        raise KeyError(topic)
    sent: Sent = []

    def note(msg: Any, info: dict[str, int]) -> None:
        """Note one."""
        sent.append((1e-9 * info["source_timestamp"], stamp(msg)))

    node, executor = rclpy.create_node("send_times", namespace=NAMESPACE), SingleThreadedExecutor()
    is_over = threading.Event()
    node.create_subscription(message_class(stream.type), topic, note, DEEP_QOS)
    executor.add_node(node)

    def listen() -> None:
        """Hear until it is over."""
        while not is_over.is_set():
            executor.spin_once(timeout_sec=_LOOK)

    thread = threading.Thread(target=listen, name="send_times")
    thread.start()
    try:
        yield sent
    finally:
        is_over.set()
        thread.join()
        executor.shutdown()
        node.destroy_node()
