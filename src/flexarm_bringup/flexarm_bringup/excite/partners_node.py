"""Nodes that another one waits for, by their ``ready`` topics: whom for, and at last that it was in vain."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from rclpy.node import Node
from std_msgs.msg import Bool

from flexarm_bringup.series import SeriesError
from flexarm_model.ros.node import LATCHED_QOS


class Partners:
    """Waits for nodes."""

    def __init__(self, node: Node, names: Sequence[str], patience: float) -> None:
        """Subscribe to what they say.

        Args:
            node: Who waits, and tells it.
            names: Of the nodes.
            patience: Longest wait [s].
        """
        self._say, self._patience, self._said = node.get_logger().info, patience, ""
        self._ready = dict.fromkeys(names, False)
        for name in names:
            node.create_subscription(Bool, f"{name}/ready", self._noting(name), LATCHED_QOS)

    def are_ready(self, waited: float, also: str = "") -> bool:
        """Tell whether all are, and say for which topics it is waited.

        Args:
            waited: How long so far [s].
            also: Topic that is silent otherwise; empty when nothing is missing.

        Raises:
            SeriesError: It was waited in vain.
        """
        unready = [f"{name}/ready" for name, is_ready in self._ready.items() if not is_ready]
        missing = unready or ([also] if also else [])
        words = f"waiting for {', '.join(missing)}"
        if missing and waited > self._patience:
            raise SeriesError(f"no progress for {self._patience:g} s: {words}")
        if missing and words != self._said:
            self._said = words
            self._say(words)
        return not missing

    def _noting(self, name: str) -> Callable[[Bool], None]:
        return lambda msg: self._ready.__setitem__(name, bool(msg.data))
