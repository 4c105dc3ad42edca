"""What a node declares: ROS parameters, one per field of its settings classes, and nothing else.

Everything that is wrong with what was given is told with its source (the parameter file, or the command
line), the key, the value and what is allowed.
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields
from functools import cache
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSPolicyKind

from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.ros.parameter_file import ParameterSource, parameter_sources, refuse_strangers
from flexarm_model.settings.overrides import apply_overrides
from flexarm_model.settings.parameters import ParameterError
from flexarm_model.settings.strict_yaml import ConfigError

_TYPES = {
    bool: Parameter.Type.BOOL,
    int: Parameter.Type.INTEGER,
    float: Parameter.Type.DOUBLE,
    str: Parameter.Type.STRING,
    (bool,): Parameter.Type.BOOL_ARRAY,
    (int,): Parameter.Type.INTEGER_ARRAY,
    (float,): Parameter.Type.DOUBLE_ARRAY,
    (str,): Parameter.Type.STRING_ARRAY,
}
# parameters that rclpy declares when a publisher or subscription is made, which may be after a node's own:
# qos_overrides./topic.publisher.depth, or publisher_ID where there are several (rclpy.qos_overriding_options)
_QOS_OVERRIDE = re.compile(
    r"qos_overrides\.(/[A-Za-z_]\w*)+\.(publisher|subscription)(_\w+)?\."
    rf"({'|'.join(kind.lower() for kind in QoSPolicyKind.__members__)})",
    re.ASCII,
)
_INT64_MAX = 2**63 - 1
# fixed as all others: the clock would jump while the arm moves, and its topic go when a node is deactivated
_SIM_TIME = ParameterDescriptor(
    name="use_sim_time",
    description="Clock of the topic /clock.",
    type=Parameter.Type.BOOL.value,
    read_only=True,
)

Config = TypeVar("Config")


def declare_config(node: Node, config_class: type[Config], complete: bool = True) -> Config:
    """Declare one read-only ROS parameter per field and return the settings as given.

    Args:
        node: Node whose overrides (parameter file, command line) are used.
        config_class: Frozen dataclass whose fields were made with ``parameters.parameter``.
        complete: Refuse overrides that nobody declared; False when more settings follow.

    Raises:
        ParameterError: A value is of the wrong type or outside its range, or a key is unknown.
        ConfigError: A parameter file is not for this node.
    """
    given = {name: item.value for name, item in node._parameter_overrides.items() if item.value is not None}
    for place, keys in _places(node):
        with _told_with(place):
            apply_overrides(config_class, {key: given[key] for key in keys if key in given})
    config = apply_overrides(config_class, given)
    hints = get_type_hints(config_class)
    for item in fields(config_class):  # type: ignore[arg-type]
        _declare(node, item.name, getattr(config, item.name), hints[item.name], item.metadata)
    if complete:
        refuse_unknown_parameters(node)
    return config


def declare_configs(node: Node) -> tuple[Any, ...]:
    """Declare the parameters of every settings class in ``node.SETTINGS`` and return the settings as given.

    Raises:
        ParameterError, ConfigError: See ``declare_config``.
    """
    settings = tuple(declare_config(node, kind, complete=False) for kind in node.SETTINGS)
    refuse_unknown_parameters(node)
    node.set_descriptor("use_sim_time", _SIM_TIME)
    return settings


def refuse_unknown_parameters(node: Node) -> None:
    """Check that every parameter given to the node has been declared.

    Raises:
        ParameterError: One has not; the message lists those that exist. What rclpy declares of itself, the
            quality of service of topics apart, is among them.
    """
    allowed = ", ".join(sorted(name for name in node._parameters if not is_qos_override(name)))
    for place, keys in (*_places(node), ("", tuple(sorted(node._parameter_overrides)))):
        for name in keys:
            if name not in node._parameters and not is_qos_override(name):
                with _told_with(place):
                    raise ParameterError(
                        f"{name}: unknown parameter of {node.get_name()}; allowed: {allowed}"
                    )


def is_qos_override(name: str) -> bool:
    """Return whether a parameter has the form of those for the quality of service of a topic."""
    return _QOS_OVERRIDE.fullmatch(name) is not None


def load_arm(node: Node, manipulator: str, preset: str) -> ManipulatorConfig:
    """Load the manipulator that a node was told.

    Raises:
        ConfigError: There is no such file or preset, or it is wrong; tells who asked for it.
    """
    with told_by(node, "manipulator", "preset"):
        return load_config(find_manipulator(manipulator), preset)


@contextmanager
def told_by(node: Node, *keys: str) -> Iterator[None]:
    """Add to an error in what parameters mean where they were given."""
    places = [place for place, given in _places(node) if any(key in given for key in keys)]
    with _told_with(", ".join(places)):
        yield


def _places(node: Node) -> list[tuple[str, tuple[str, ...]]]:
    """Return every place where this node is given parameters, with their names."""
    name = node.get_fully_qualified_name()
    sources = _sources(tuple(sys.argv))
    for source in sources:
        refuse_strangers(source, name, getattr(node, "BESIDE", ()))
    return [(f"{source.name}: {name}", source.keys_for(name)) for source in sources if source.keys_for(name)]


@cache
def _sources(arguments: tuple[str, ...]) -> tuple[ParameterSource, ...]:
    return parameter_sources(arguments)


@contextmanager
def _told_with(place: str) -> Iterator[None]:
    try:
        yield
    except (ParameterError, ConfigError) as error:
        if not place:
            raise
        raise type(error)(f"{place}: {error}") from None


def _declare(node: Node, name: str, value: Any, hint: Any, about: Mapping[str, Any]) -> None:
    kind = (get_args(hint)[0],) if get_origin(hint) is tuple else hint
    is_empty = isinstance(value, tuple) and not value  # an empty list is one of bytes to rclpy
    descriptor = _descriptor(name, kind, about)
    descriptor.dynamic_typing = is_empty
    default = list(value) if isinstance(value, tuple) else value
    node._parameter_overrides[name] = Parameter(name, None if is_empty else _TYPES[kind], default)
    node.declare_parameter(name, default if is_empty else _TYPES[kind], descriptor)
    if is_empty:
        node._parameters[name] = Parameter(name, _TYPES[kind], [])
        node._descriptors[name] = _descriptor(name, kind, about)


def _descriptor(name: str, kind: Any, about: Mapping[str, Any]) -> ParameterDescriptor:
    low, high = about["minimum"], about["maximum"]
    allowed = f"; one of {', '.join(about['choices'])}" if about["choices"] else ""
    text = f"{about['text']} [{about['unit']}]{allowed}"
    descriptor = ParameterDescriptor(name=name, description=text, type=_TYPES[kind].value, read_only=True)
    if math.isinf(low) and math.isinf(high):
        return descriptor
    if kind is float:
        descriptor.floating_point_range = [FloatingPointRange(from_value=float(low), to_value=float(high))]
    if kind is int:
        low, high = (int(max(-_INT64_MAX, min(bound, _INT64_MAX))) for bound in (low, high))
        descriptor.integer_range = [IntegerRange(from_value=low, to_value=high)]
    return descriptor
