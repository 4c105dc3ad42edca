"""A logger for nodes that keep time: the same lines as rclpy's, without its search for where they come from.

For every line rclpy looks through all loaded modules, and reads the file that the line is of: for the first
one some 0.1 ms per module, which is longer than the guard bears silence where a node has loaded the libraries
of a controller, then 0.6 ms for each that follows, also for those that are throttled. And that just when
something happens that is worth a line. The interpreter knows the place without a search.
"""

from __future__ import annotations

import sys
import time
from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.impl.rcutils_logger import RcutilsLogger
from rclpy.node import Node

_CALLER = 2  # frames above ``log``: the caller of ``info``, ``warning``, ...
_THROTTLE = "throttle_duration_sec"


class NodeLogger(RcutilsLogger):  # type: ignore[misc]
    """Logs to terminal, file and /rosout as rclpy's logger of the same name does."""

    def __init__(self, name: str) -> None:
        """Take the name of a logger."""
        super().__init__(name)
        self._logged: dict[tuple[str, int], float] = {}  # last line of every throttled place [s]

    def log(self, message: str, severity: int, **options: Any) -> bool:
        """Log unless that is throttled; options other than ``throttle_duration_sec`` are left to rclpy.

        Returns:
            Whether the message was logged.
        """
        if options.keys() - {_THROTTLE}:
            return bool(super().log(message, severity, **options))
        if not self.is_enabled_for(severity):
            return False
        frame = sys._getframe(_CALLER)
        file, line = frame.f_code.co_filename, frame.f_lineno
        if options and self._is_too_soon((file, line), float(options[_THROTTLE])):
            return False
        rclpy_implementation.rclpy_logging_rcutils_log(
            severity, self.name, str(message), frame.f_code.co_name, file, line
        )
        return True

    def _is_too_soon(self, place: tuple[str, int], pause: float) -> bool:
        now = time.monotonic()
        if now - self._logged.get(place, -pause) < pause:
            return True
        self._logged[place] = now
        return False


class FastLogging(Node):  # type: ignore[misc]
    """A node, or what a node is also derived from, whose lines are not searched for."""

    _fast_logger: NodeLogger | None = None  # rclpy asks for it before the derived class has begun

    def get_logger(self) -> NodeLogger:
        """Return the logger of this node, a fast one."""
        if self._fast_logger is None:
            self._fast_logger = NodeLogger(super().get_logger().name)
        return self._fast_logger
