"""A request of a service, or any message, filled with what a user wrote; nothing is guessed at.

The types of its fields are told by the message itself: "double", "string", "sequence<double>", "double[36]",
"geometry_msgs/Pose".
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

from flexarm_bringup.message_class import message_class

_LIST = re.compile(r"sequence<(?P<of>[^,]+?)(, (?P<most>\d+))?>$|(?P<each>[^<]+)\[(?P<length>\d+)\]$")
_WHOLE = re.compile(r"(?P<sign>u?)int(?P<bits>\d+)$|octet$")
_REALS = ("double", "float", "long double")


class RequestError(ValueError):
    """A value does not fit; the message names the field and says what is allowed."""


def fill(msg: Any, values: Mapping[str, Any], where: str = "") -> None:
    """Set fields of a message; those that are not named stay as they are.

    Args:
        msg: A message, or a request.
        values: By field, with mappings for messages within messages.
        where: Dotted name of ``msg`` within the request, for messages.

    Raises:
        RequestError: There is no such field, or its value is of another kind.
    """
    fields = msg.get_fields_and_field_types()
    for name, value in values.items():
        if name not in fields:
            allowed = ", ".join(f"{known} ({kind})" for known, kind in fields.items()) or "none"
            raise RequestError(f"{where or 'the request'} has no field '{name}'; its fields: {allowed}")
        inner = f"{where}.{name}" if where else name
        setattr(msg, name, _value(value, fields[name], inner))


def _value(value: Any, kind: str, where: str) -> Any:
    """Return a value as the message holds it."""
    found = _LIST.match(kind)
    if found:
        return _list(value, found, where)
    if "/" in kind:
        if not isinstance(value, Mapping):
            raise RequestError(f"{where}: {value!r}: expected a mapping, {kind}")
        package, name = kind.split("/")
        msg = message_class(f"{package}/msg/{name}")()
        fill(msg, value, where)
        return msg
    return _scalar(value, kind, where)


def _list(value: Any, found: re.Match[str], where: str) -> list[Any]:
    kind = found["of"] or found["each"]
    length, most = (int(found[name]) if found[name] else None for name in ("length", "most"))
    if not isinstance(value, list):
        raise RequestError(f"{where}: {value!r}: expected a list of {kind}")
    if length is not None and len(value) != length:
        raise RequestError(f"{where}: has {len(value)} values: expected {length}")
    if most is not None and len(value) > most:
        raise RequestError(f"{where}: has {len(value)} values: expected at most {most}")
    return [_value(item, kind, f"{where}[{k}]") for k, item in enumerate(value)]


def _scalar(value: Any, kind: str, where: str) -> Any:
    whole = _WHOLE.match(kind)
    if kind == "boolean" and isinstance(value, bool):
        return value
    if kind.startswith(("string", "wstring")) and isinstance(value, str):
        return value
    if kind in _REALS and (number := _number(value)) is not None:
        return number
    if whole and isinstance(value, int) and not isinstance(value, bool) and _fits(value, whole):
        return value
    raise RequestError(f"{where}: {value!r}: expected {'true or false' if kind == 'boolean' else kind}")


def _number(value: Any) -> float | None:
    """Return a number, also one that YAML takes for a text: "1e-4"."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return None
    try:
        number = float(value)
    except (ValueError, OverflowError):
        return None
    return number if not isinstance(value, str) or math.isfinite(number) else None


def _fits(value: int, whole: re.Match[str]) -> bool:
    bits = int(whole["bits"] or 8)  # an octet has no sign
    lowest = -(1 << bits - 1) if whole["sign"] == "" else 0
    return lowest <= value < lowest + (1 << bits)
