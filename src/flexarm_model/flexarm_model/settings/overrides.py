"""Settings made of their defaults and of what somebody gave: a parameter file, a bag, a command line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import Field, fields
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from flexarm_model.settings.parameters import ParameterError, spoken_limits, validate

Config = TypeVar("Config")
_WORDS = {
    float: ("a number", "numbers"),
    int: ("a whole number", "whole numbers"),
    bool: ("true or false", "true or false"),
    str: ("a text", "texts"),
}


def apply_overrides(config_class: type[Config], given: Mapping[str, Any]) -> Config:
    """Return settings with the values that are given and defaults for the rest.

    Args:
        config_class: Frozen dataclass whose fields were made with ``parameters.parameter``.
        given: Values by field; lists for tuples, integers for floats are taken; other keys are left alone.

    Raises:
        ParameterError: A value is of the wrong type or outside its range.
    """
    hints = get_type_hints(config_class)
    values = {
        item.name: _coerce(item, given.get(item.name, item.default), hints[item.name])
        for item in fields(config_class)  # type: ignore[arg-type]
    }
    config = config_class(**values)
    validate(config)
    return config


def check_overrides(config_classes: Sequence[type[Any]], given: Mapping[str, Any]) -> None:
    """Check that what is given is for settings classes that share one mapping, as those of a node do.

    Raises:
        ParameterError: None of them has such a field, or a value is of the wrong type or outside its range.
    """
    allowed = sorted({item.name for kind in config_classes for item in fields(kind)})
    for name in given:
        if name not in allowed:
            raise ParameterError(f"{name}: unknown; allowed: {', '.join(allowed)}")
    for kind in config_classes:
        apply_overrides(kind, given)


def _coerce(item: Field[Any], value: Any, hint: Any) -> Any:
    """Return ``value`` in the type of the field; integers are accepted for floats."""
    wants_array, is_array = (
        get_origin(hint) is tuple,
        hasattr(value, "__iter__") and not isinstance(value, str),
    )
    wanted = get_args(hint)[0] if wants_array else hint
    elements = list(value) if is_array else [value]
    if wants_array != is_array or not all(_fits(element, wanted) for element in elements):
        one, many = _WORDS[wanted]
        kind = f"a list of {many}" if wants_array else one
        raise ParameterError(f"{item.name}: {value!r} is not {kind}{spoken_limits(item.metadata)}")
    return tuple(map(wanted, elements)) if wants_array else wanted(value)


def _fits(value: Any, wanted: type) -> bool:
    if wanted is float:
        return isinstance(value, int | float) and not isinstance(value, bool)
    return type(value) is wanted
