"""Messages written as bytes, in a fraction of the time: those of a topic look alike.

To make a message costs rclpy a constructor for each of its parts, to write it a look at every field; but from
one message to the next only some numbers change. So the first two are written by rclpy, and the second shows
where in the bytes (CDR of OMG DDS-XTypes 1.3, 7.4.1, little endian) these numbers lie; in the next ones they
are replaced. The first is not searched: with a text that is another each time, every message is a first one.
A publisher of rclpy takes bytes as well as messages. The other direction: ``message_reader``.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Hashable, Iterator, Sequence
from struct import Struct, calcsize
from typing import Any

from flexarm_model.ros.message_reader import CODES, HEAD, LITTLE_ENDIAN_CDR

MOST_LAYOUTS = 64  # that are remembered; who needs more has none
NS_PER_S = 1_000_000_000
STAMP = ("header.stamp.sec", "header.stamp.nanosec")
Serialise = Callable[[Any], bytes]
Place = tuple[int, str]  # in the bytes, and its struct format
_END = ""  # name of the place after the last field
_COUNT = 4  # bytes of the length before a text or a sequence


def stamp_values(stamp_ns: int) -> tuple[tuple[int], tuple[int]]:
    """Return the values of ``STAMP`` for a stamp [ns]."""
    sec, nanosec = divmod(stamp_ns, NS_PER_S)
    return (sec,), (nanosec,)


class MessageWriter:
    """Writes the messages of one topic."""

    def __init__(self, varying: Sequence[str], serialise: Serialise) -> None:
        """Know no message yet.

        Args:
            varying: Fields that change, such as "header.frame_id": numbers, texts, sequences of numbers.
            serialise: Writes any message.
        """
        self._varying, self._serialise = tuple(varying), serialise
        self._layouts: dict[Hashable, _Layout | None] = {}
        self._met: set[Hashable] = set()  # keys that have come once

    def write(self, key: Hashable, values: Sequence[Sequence[Any]], make: Callable[[], Any]) -> Any:
        """Return the bytes of a message, or a message where these are not known; a publisher takes both.

        Args:
            key: Equal for messages that differ in nothing but the varying fields, and these not in length.
            values: Of the varying fields: (number,), (text as bytes,), or the elements of a sequence.
            make: Makes the message; called for the first two of a key.

        Raises:
            KeyError: There is no such field.
        """
        layout = self._layouts.get(key)
        if layout is not None:
            return layout.write(values)
        msg = make()
        if key in self._met:
            self._met.remove(key)
            self._learn(key, values, msg)
        elif key not in self._layouts:
            if len(self._met) >= MOST_LAYOUTS:
                self._met.clear()
            self._met.add(key)
        return msg

    def _learn(self, key: Hashable, values: Sequence[Sequence[Any]], msg: Any) -> None:
        """Remember where the values of a message are, or that they are not found."""
        if len(self._layouts) >= MOST_LAYOUTS:
            self._layouts.clear()
        raw, self._layouts[key] = self._serialise(msg), None
        if raw[:2] != LITTLE_ENDIAN_CDR or sys.byteorder != "little":
            return
        places = dict(_places(msg))
        end = places.pop(_END, None)
        if end is not None and end[0] <= len(raw):  # a text with a zero in it is written cut short
            raw = raw[: end[0]]  # rclpy adds some that belong to nothing
            layout = _Layout(raw, [places[name] for name in self._varying])
            self._layouts[key] = layout if layout.write(values) == raw else None


class _Layout:
    """A message, and where its values are."""

    def __init__(self, raw: bytes, places: Sequence[Place]) -> None:
        self._raw = raw
        self._packs = [(Struct(code).pack_into, offset) for offset, code in places]

    def write(self, values: Sequence[Sequence[Any]]) -> bytes:
        """Return the message with other values."""
        written = bytearray(self._raw)
        for (pack, offset), value in zip(self._packs, values, strict=True):
            pack(written, offset, *value)
        return bytes(written)


def _places(msg: Any) -> Iterator[tuple[str, Place]]:
    """Yield the fields of a message by name, those of its parts after a dot, and where each of them is.

    Up to the first one of a type that is not known here; without any, where the message ends.
    """
    at = HEAD
    for name, type_name, value in _fields(msg, ""):
        if type_name == "string":
            at = _aligned(at, _COUNT) + _COUNT
            size, length = 1, len(value.encode())
            code, end = f"<{length}s", at + length + 1
        elif type_name in CODES:
            size = calcsize(CODES[type_name])
            length = 1 if value is None else len(value)
            at = _aligned(at, size) if length else at
            code, end = f"<{length}{CODES[type_name]}", at + length * size
        elif type_name == "":  # the length of a sequence
            at, code, end = _aligned(at, _COUNT), "<I", _aligned(at, _COUNT) + _COUNT
        else:
            return
        yield name, (at, code)
        at = end
    yield _END, (at, "")


def _fields(msg: Any, before: str) -> Iterator[tuple[str, str, Any]]:
    """Yield name, type and content of everything in a message, in order; of a number no content."""
    for field, type_name in msg.get_fields_and_field_types().items():
        yield from _content(f"{before}{field}", type_name, getattr(msg, field))


def _content(name: str, type_name: str, value: Any) -> Iterator[tuple[str, str, Any]]:
    is_sequence = type_name.startswith("sequence<")
    if not is_sequence and not type_name.endswith("]"):
        if hasattr(value, "get_fields_and_field_types"):
            yield from _fields(value, f"{name}.")
        else:
            yield name, type_name, value if type_name == "string" else None
        return
    element = type_name.removeprefix("sequence<").partition(">")[0].partition("[")[0].partition(",")[0]
    if is_sequence:
        yield f"{name}.length", "", None
    if element in CODES:
        yield name, element, value
        return
    for i, each in enumerate(value):
        yield from _content(f"{name}.{i}", element, each)


def _aligned(at: int, size: int) -> int:
    """Return the next place that is a multiple of a size, counted from the head."""
    return at + (HEAD - at) % size
