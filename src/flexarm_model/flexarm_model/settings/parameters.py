"""Settings of a node as one frozen dataclass: schema of its YAML, source of its ROS parameters.

A field made with ``parameter`` carries its text, unit and range; ``validate`` refuses what is
outside. Nodes declare their ROS parameters from the same fields (``node.declare_config``).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import field, fields
from typing import Any


class ParameterError(ValueError):
    """A setting is outside what its field allows; the message names key, value and range."""


def parameter(
    default: Any,
    text: str,
    unit: str = "1",
    minimum: float = -math.inf,
    maximum: float = math.inf,
    choices: Sequence[str] = (),
) -> Any:
    """Return a dataclass field that documents itself.

    Args:
        default: Default value; lists are given as tuples.
        text: One sentence for ``ros2 param describe``.
        unit: SI unit, "1" when there is none.
        minimum: Smallest value allowed, of every element.
        maximum: Largest value allowed.
        choices: For strings, the values allowed; empty means any.
    """
    metadata = {"text": text, "unit": unit, "minimum": minimum, "maximum": maximum, "choices": tuple(choices)}
    return field(default=default, metadata=metadata)


def validate(config: Any) -> None:
    """Check every field of a settings dataclass.

    Raises:
        ParameterError: A number is not finite or outside its range, or a string is not a choice.
    """
    for item in fields(config):
        value = getattr(config, item.name)
        for element in value if isinstance(value, tuple) else (value,):
            _check(item.name, element, item.metadata)


def spoken_limits(about: Mapping[str, Any]) -> str:
    """Return what the metadata of a field allows, to be put behind "is not a number"; maybe nothing."""
    if about["choices"]:
        return f", one of {', '.join(about['choices'])}"
    low, high = about["minimum"], about["maximum"]
    unit = "" if about["unit"] == "1" else f" {about['unit']}"
    return "" if math.isinf(low) and math.isinf(high) else f" in [{low}, {high}]{unit}"


def _check(name: str, value: Any, about: Mapping[str, Any]) -> None:
    if isinstance(value, str):
        if about["choices"] and value not in about["choices"]:
            raise ParameterError(f"{name}: '{value}' is not one of {', '.join(about['choices'])}")
    elif not isinstance(value, bool) and not (
        math.isfinite(value) and about["minimum"] <= value <= about["maximum"]
    ):
        raise ParameterError(f"{name}: {value} is not a finite number{spoken_limits(about)}")
