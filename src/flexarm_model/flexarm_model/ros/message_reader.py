"""Messages read from their bytes, in a fraction of the time: those of a topic look alike.

What rclpy makes of the bytes of a message costs it far more than to receive them: for every field it looks up
modules and calls constructors. But from one message of a sensor to the next only numbers change. So the first
one is read by rclpy, and shows where in the bytes (CDR of OMG DDS-XTypes 1.3, 7.4.1, little endian) its
numbers and texts lie; one that has the same lengths is read from there. Every other one is read by rclpy.
"""

from __future__ import annotations

import sys
from array import array
from collections.abc import Callable
from struct import Struct, calcsize
from typing import Any

import numpy as np

LITTLE_ENDIAN_CDR = b"\x00\x01"  # first two of the four bytes before the content, from which alignment counts
HEAD = 4  # bytes
MOST_SHAPES = 16  # that are remembered; who sends so many has none
MOST_VALUES = 500  # of a message that is read like this
CODES = {
    "boolean": "?", "octet": "B", "uint8": "B", "int8": "b", "uint16": "H", "int16": "h", "uint32": "I",
    "int32": "i", "uint64": "Q", "int64": "q", "float": "f", "double": "d",
}  # fmt: skip
Values = tuple[Any, ...]
Make = Callable[[Values], Any]


class _NotAlike(Exception):
    """A message does not have the shape that it seemed to have."""


class MessageReader:
    """Reads the messages of one topic."""

    def __init__(self, kind: type, deserialise: Callable[[bytes], Any]) -> None:
        """Know no message yet.

        Args:
            kind: Class of the messages.
            deserialise: Reads any message from its bytes; what it raises goes to the caller.
        """
        self._kind, self._deserialise = kind, deserialise
        self._shapes: dict[int, _Shape] = {}

    def read(self, raw: bytes) -> Any:
        """Return the message; raises what ``deserialise`` raises for bytes that are none."""
        shape = self._shapes.get(len(raw))
        if shape is not None:
            try:
                return shape.read(raw)
            except _NotAlike:
                pass
        msg = self._deserialise(raw)
        self._learn(raw, msg)
        return msg

    def _learn(self, raw: bytes, msg: Any) -> None:
        """Remember the shape of a message if it can be read like this."""
        if raw[:2] != LITTLE_ENDIAN_CDR or sys.byteorder != "little":
            return
        try:
            shape = _Shape(self._kind, msg)
            is_same = shape.size <= len(raw) and shape.read(raw) == msg  # Fast DDS may send more than is used
        except (_NotAlike, KeyError):  # a type that is not known here
            return
        if is_same:  # never with NaN: the next one will do
            if len(self._shapes) >= MOST_SHAPES:
                self._shapes.clear()
            self._shapes[len(raw)] = shape


class _Shape:
    """Where in the bytes of a message its fields lie.

    Attributes:
        size: Of the message [bytes].
    """

    def __init__(self, kind: type, msg: Any) -> None:
        self._format, self._values, self.size = ["<2sxx"], 1, HEAD
        self._fixed: list[tuple[int, Any]] = [(0, LITTLE_ENDIAN_CDR)]
        self._make = self._message(kind, msg)
        self._struct = Struct("".join(self._format))

    def read(self, raw: bytes) -> Any:
        """Return the message.

        Raises:
            _NotAlike: Its lengths are others.
        """
        values = self._struct.unpack_from(raw)
        for place, value in self._fixed:
            if values[place] != value:
                raise _NotAlike
        return self._make(values)

    def _message(self, kind: Any, msg: Any) -> Make:
        fields = [
            (f"_{name}", self._field(type_name, getattr(msg, name)))
            for name, type_name in kind.get_fields_and_field_types().items()
        ]
        new = kind.__new__

        def make(values: Values) -> Any:
            """Return a message of these values."""
            made = new(kind)
            for slot, field in fields:
                setattr(made, slot, field(values))
            return made

        return make

    def _field(self, type_name: str, value: Any) -> Make:
        if type_name.startswith("sequence<"):
            element = type_name[len("sequence<") :].rstrip(">").split(",")[0]
            self._add("I", len(value))
            return self._elements(element, value)
        if type_name.endswith("]"):
            return self._elements(type_name.partition("[")[0], value)
        return self._one(type_name, value)

    def _elements(self, type_name: str, value: Any) -> Make:
        """Return what makes a sequence or an array."""
        if type_name in CODES and isinstance(value, (array, np.ndarray)):
            return self._numbers(type_name, value)
        makes = [self._one(type_name, element) for element in value]
        return lambda values: [make(values) for make in makes]

    def _numbers(self, type_name: str, value: Any) -> Make:
        if not len(value):
            return lambda values: value[:0]
        self._align(calcsize(CODES[type_name]))
        place = self._add(f"{len(value) * value.itemsize}s")
        if isinstance(value, array):
            code = value.typecode
            return lambda values: array(code, values[place])
        dtype = value.dtype
        return lambda values: np.frombuffer(values[place], dtype).copy()

    def _one(self, type_name: str, value: Any) -> Make:
        """Return what makes a text, a number or a message."""
        if type_name == "string":
            return self._text(value)
        if type_name in CODES:
            place = self._add(CODES[type_name])
            return lambda values: values[place]
        return self._message(type(value), value)

    def _text(self, text: str) -> Make:
        known = text.encode() + b"\0"
        self._add("I", len(known))
        place = self._add(f"{len(known)}s")

        def make(values: Values) -> str:
            """Return the text among these values."""
            told = values[place]
            if told == known:
                return text
            if told.find(0) != len(told) - 1:  # rclpy ends a text at its first zero
                raise _NotAlike
            try:
                return str(told[:-1], "utf8")
            except UnicodeDecodeError as error:
                raise _NotAlike from error

        return make

    def _add(self, code: str, fixed: int | None = None) -> int:
        """Add a value to the format; return its place among the values. ``fixed`` where it may not change."""
        if self._values > MOST_VALUES:
            raise _NotAlike
        size = calcsize(code)
        if not code.endswith("s"):
            self._align(size)
        if fixed is not None:
            self._fixed.append((self._values, fixed))
        self._format.append(code)
        self.size += size
        self._values += 1
        return self._values - 1

    def _align(self, size: int) -> None:
        gap = (HEAD - self.size) % size
        self._format.append("x" * gap)
        self.size += gap
