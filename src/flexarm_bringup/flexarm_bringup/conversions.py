"""Messages as bytes and back.

``serialise`` fills the gaps that alignment leaves with zeros. rclpy leaves there, and behind empty
arrays at the end, what the memory held before: its bytes differ from run to run for equal messages.
"""

from __future__ import annotations

from typing import Any

from rclpy.serialization import deserialize_message, serialize_message

from flexarm_bringup.bags.bag_types import bag_types
from flexarm_bringup.bags.cdr import LITTLE_ENDIAN
from flexarm_bringup.message_class import message_class


def serialise(msg: Any, kind: str) -> bytes:
    """Return a message as CDR; equal messages give equal bytes."""
    return zero_padding(bytes(serialize_message(msg)), kind)


def deserialise(cdr: bytes, kind: str) -> Any:
    """Return the message of a CDR."""
    return deserialize_message(cdr, message_class(kind))


def zero_padding(cdr: bytes, kind: str) -> bytes:
    """Return the same message with zeros in the gaps of alignment and nothing after its end."""
    types = bag_types()
    definition = types.get_msgdef(kind)
    decode = definition.deserialize_cdr_le if cdr[1] & LITTLE_ENDIAN else definition.deserialize_cdr_be
    message, _ = decode(cdr[4:], 0, definition.cls, types)
    return bytes(types.serialize_cdr(message, kind))
