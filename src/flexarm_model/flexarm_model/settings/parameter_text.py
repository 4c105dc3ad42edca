"""Parameters in words: default values and what is allowed, for tables and helps."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any


def value_text(value: Any) -> str:
    """Return a value as ROS writes it on a command line."""
    if isinstance(value, tuple):
        return f"[{', '.join(map(value_text, value))}]"
    if isinstance(value, str):
        return f'"{value}"'
    return str(value).lower() if isinstance(value, bool) else f"{value:.6g}"


def allowed_text(default: Any, about: Mapping[str, Any]) -> str:
    """Return what a parameter may be.

    Args:
        default: Its default value.
        about: Its minimum, maximum and choices, as ``parameter`` keeps them.
    """
    low, high = about["minimum"], about["maximum"]
    if about["choices"]:
        return ", ".join(about["choices"])
    if isinstance(default, bool):
        return "true, false"
    if math.isinf(low) and math.isinf(high):
        return "any"
    if math.isinf(high):
        return f"at least {low:.6g}"
    return f"at most {high:.6g}" if math.isinf(low) else f"{low:.6g} to {high:.6g}"


def table_lines(rows: list[tuple[str, str, str, str, str]]) -> list[str]:
    """Return lines for a terminal from name, default, unit, allowed and text of every parameter."""
    width = max((len(row[0]) for row in rows), default=0)
    return [
        f"{name:{width}}  {default}{'' if unit == '1' else ' ' + unit}   {text}  [{allowed}]"
        for name, default, unit, allowed, text in rows
    ]
