"""Answers of services that wait for who asked instead of blocking the node.

A request may be here before it is known where its answer is to go: discovery takes both ways by itself. The
middleware then blocks whoever answers, up to 100 ms for one that never hears, and with it the whole process:
an armed arm was stopped by a call. Here such an answer is kept until its reader has been discovered, or given
up after ``PATIENCE`` with a word in the log.
"""

from __future__ import annotations

import ctypes
import time
from collections.abc import Callable
from functools import partial
from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy

PATIENCE, RETRY = 3.0, 0.01  # s
_GUID_SIZE = 16  # bytes of rmw_request_id_t before its sequence number
_VALUE_AT = 2 * ctypes.sizeof(ctypes.c_void_p)  # of a simple object of pybind11, behind its head


class LateAnswer:
    """What a service returns in place of a response that is not known yet."""

    def __init__(self) -> None:
        """Know neither the response nor how to send it."""
        self._response: Any = None
        self._send: Callable[[Any], None] | None = None

    def give(self, response: Any) -> None:
        """Let this be the response."""
        self._response = response
        self._go()

    def go_by(self, send: Callable[[Any], None]) -> None:
        """Let it be sent by this as soon as it is known."""
        self._send = send
        self._go()

    def _go(self) -> None:
        if self._send is not None and self._response is not None:
            self._send(self._response)


class PatientAnswers:
    """Sends the answers of one service."""

    def __init__(self, node: Node, service: Any, wake: Callable[[], None]) -> None:
        """Take the place of the service's own sending.

        Args:
            node: Offers the service.
            service: Of it.
            wake: Called when an answer has to wait; ``retry`` is to be called every ``RETRY`` then.
        """
        self._wake = wake
        self._node, self._send, self._name = node, service.send_response, service.service_name
        self._is_volatile = service.qos_profile.durability != DurabilityPolicy.TRANSIENT_LOCAL
        self._kept: list[tuple[float, bytes, Any, Any]] = []
        self._is_over = False

    def send(self, response: Any, header: Any) -> None:
        """Send an answer now, if it is known and its reader is there, or later."""
        if isinstance(response, LateAnswer):
            response.go_by(partial(self.send, header=header))
            return
        if self._is_over:
            return
        reader = reader_of(header)
        if not reader or self._is_there(reader):
            self._send(response, header)
            return
        self._kept.append((time.monotonic() + PATIENCE, reader, response, header))
        self._wake()

    def end(self) -> None:
        """Answer nobody any more, late answers neither."""
        self._kept.clear()
        self._is_over = True

    def retry(self) -> bool:
        """Send what can be sent by now; returns whether there are answers that have to wait."""
        now, kept, self._kept = time.monotonic(), self._kept, []
        for until, reader, response, header in kept:
            if self._is_there(reader):
                self._send(response, header)
            elif now < until:
                self._kept.append((until, reader, response, header))
            else:
                self._node.get_logger().warning(
                    f"{self._name}: no answer sent: who asked cannot hear it (not discovered, or its quality "
                    "of service does not fit)"
                )
        return bool(self._kept)

    def _is_there(self, reader: bytes) -> bool:
        """Return whether the reader of an answer has been discovered, and can hear it."""
        for info in self._node.get_subscriptions_info_by_topic(f"rr{self._name}Reply", no_mangle=True):
            if bytes(info.endpoint_gid[:_GUID_SIZE]) == reader:
                wants_past = info.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
                return not (wants_past and self._is_volatile)
        return False


def reader_of(header: Any) -> bytes:
    """Return the identity of who waits for the answer to a request; empty where it cannot be read.

    rclpy does not show it. It stands in front of the sequence number, which proves that it was found.
    """
    asked = getattr(header, "request_id", header)
    if type(asked).__name__ != "rmw_request_id_t":
        return b""
    value = ctypes.c_void_p.from_address(id(asked) + _VALUE_AT).value
    if not value or ctypes.c_int64.from_address(value + _GUID_SIZE).value != asked.sequence_number:
        return b""
    return ctypes.string_at(value, _GUID_SIZE)
