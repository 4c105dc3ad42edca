"""Fields of a message in plain values, and how they are written for a reader."""

from __future__ import annotations

import re
from typing import Any

import yaml

WIDTH = 110  # characters of a line
_INDEX = re.compile(r"\[(\d{1,9})\]")


def pick(msg: Any, field: str) -> Any:
    """Return a field of a message in plain numbers, strings, lists and dicts; all of it for "".

    Args:
        msg: The message.
        field: Names with dots between, an element of a list by its index: "sensors[0].name".

    Raises:
        AttributeError: There is no such field or element; the message lists those there are.
    """
    value, trodden = msg, ""
    for step in filter(None, field.replace("[", ".[").split(".")):
        value = _element(value, step, trodden) if step[0] == "[" else _field(value, step, trodden)
        trodden = f"{trodden}{'' if step[0] == '[' else '.'}{step}".lstrip(".")
    return plain(value)


def plain(value: Any) -> Any:
    """Return a value of a message as what YAML can write."""
    names = _fields(value)
    if names:
        return {name: plain(getattr(value, name)) for name in names}
    if isinstance(value, str | bytes | bool):
        return value if not isinstance(value, bytes) else list(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    return [plain(item) for item in value] if hasattr(value, "__iter__") else value


def written(value: Any) -> str:
    """Return plain values as YAML, and text alone as it is, so that a file can be made of it; ends a line."""
    if isinstance(value, str):
        return value if value.endswith("\n") else f"{value}\n"
    text: str = yaml.safe_dump(value, sort_keys=False, default_flow_style=None, width=WIDTH)
    return text.removesuffix("...\n")


def _field(value: Any, name: str, trodden: str) -> Any:
    names = _fields(value)
    if name not in names:
        allowed = ", ".join(names) or f"none, it is a {'list' if _is_list(value) else 'value'}"
        raise AttributeError(f"{trodden or type(value).__name__} has no field '{name}'; it has {allowed}")
    return getattr(value, name)


def _element(value: Any, step: str, trodden: str) -> Any:
    index, name = _INDEX.fullmatch(step), trodden or type(value).__name__
    if not _is_list(value):
        raise AttributeError(f"{name} has no element {step}; it is no list")
    if index is None or int(index[1]) >= len(value):
        allowed = f"0 to {len(value) - 1}" if len(value) else "none, it is empty"
        raise AttributeError(f"{name} has no element {step}; it has {allowed}")
    return value[int(index[1])]


def _is_list(value: Any) -> bool:
    return hasattr(value, "__len__") and not isinstance(value, str | bytes)


def _fields(value: Any) -> list[str]:
    return list(value.get_fields_and_field_types()) if hasattr(value, "get_fields_and_field_types") else []
