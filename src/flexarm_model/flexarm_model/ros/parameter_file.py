"""Parameter files of ROS, looked at before rcl does.

rcl takes an empty file, a key or a node given twice, a list of lists (as one list) and the parameters of a
node that nobody started without a word. Here such a file is refused, and what is wrong inside a good one can
be told with the name of the file. Values are read by rcl alone, so that both never disagree about a number.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from flexarm_model.process.ros_arguments import not_for_ros, values_of
from flexarm_model.settings.yaml_file import ConfigError, StrictLoader, read_yaml

FLEXARM_NODES = (
    "model",
    "estimator",
    "controller",
    "guard",
    "rig",
    "recorder",
    "commander",
    "excite",
    "markers",
    "drift",
)
HELD = "ros__parameters"
COMMAND_LINE = "command line"
TUPLE = "tag:yaml.org,2002:python/tuple"
_FILE_OPTION, _VALUE_OPTIONS = "--params-file", ("-p", "--param")
_OF_A_NODE = re.compile(r"(?P<node>[^:]+):(?P<key>[^:]+):=.*", re.DOTALL)


class LaunchLoader(StrictLoader):
    """Knows how launch_ros writes a list: as a tuple of Python, a tag that rcl reads past."""


def _list(loader: LaunchLoader, node: yaml.SequenceNode) -> list[Any]:
    return loader.construct_sequence(node, deep=True)


LaunchLoader.add_constructor(TUPLE, _list)


@dataclass(frozen=True)
class ParameterSource:
    """Where parameters come from.

    Attributes:
        name: The file, or "command line".
        keys: Parameters by the node they are for; nodes may hold the wildcards of rcl.
    """

    name: str
    keys: Mapping[str, tuple[str, ...]]

    def keys_for(self, node: str) -> tuple[str, ...]:
        """Return the parameters that a node of this full name gets from here."""
        return tuple(key for pattern, keys in self.keys.items() if _matches(pattern, node) for key in keys)


def refuse_stray(arguments: Sequence[str]) -> None:
    """Refuse what somebody meant as a parameter and nobody reads.

    Args:
        arguments: Program and all that it was given.

    Raises:
        ConfigError: Some are not for ROS.
    """
    if stray := list(not_for_ros(arguments[1:])):
        text = "not understood; parameters are given as --ros-args -p NAME:=VALUE, --help lists them"
        raise ConfigError(f"command line: {' '.join(stray)}: {text}")


def parameter_sources(arguments: Sequence[str]) -> tuple[ParameterSource, ...]:
    """Return what the ROS arguments of a command line give, files first; rcl takes the last of each.

    Raises:
        ConfigError: A file cannot be read, or is not a parameter file; see ``read_parameter_file``.
    """
    files = [read_parameter_file(Path(path)) for path in values_of(arguments, (_FILE_OPTION,))]
    typed: dict[str, tuple[str, ...]] = {}
    for item in values_of(arguments, _VALUE_OPTIONS):
        match = _OF_A_NODE.match(item)
        node, key = match.group("node", "key") if match else ("**", item.partition(":=")[0])
        node = f"/{node}"
        typed[node] = (*typed.get(node, ()), key)
    return (*files, *([ParameterSource(COMMAND_LINE, typed)] if typed else []))


def read_parameter_file(path: Path) -> ParameterSource:
    """Read which parameters a file gives to which nodes.

    Raises:
        ConfigError: It cannot be read, is not YAML, is empty, gives a key or a node twice, in whatever
            spellings, or does not have the form ``node: ros__parameters: key: value``.
    """
    keys: dict[str, tuple[str, ...]] = {}
    spelt: dict[str, str] = {}
    for parts, given in _sections(path, read_yaml(path, LaunchLoader), ()):
        node, spelling = _absolute(parts), ": ".join(parts)
        if node in keys:
            raise ConfigError(
                f"{path}: '{spelt[node]}' and '{spelling}' are the same node, {node}; give it once"
            )
        keys[node], spelt[node] = given, spelling
    return ParameterSource(str(path), keys)


def refuse_strangers(source: ParameterSource, node: str, beside: Sequence[str] = ()) -> None:
    """Check that what is given is for this node, or at least for one of flexarm's.

    Args:
        source: A file or the command line.
        node: Full name of the node, "/flexarm/controller".
        beside: Names, without the namespace, of the nodes in the same process; a file may be theirs alone.

    Raises:
        ConfigError: A name is nobody's, or a file gives nothing to this process.
    """
    space = node.rpartition("/")[0]
    known = (node, *(f"{space}/{name}" for name in FLEXARM_NODES if f"{space}/{name}" != node))
    others = [f"{other}/{name}" for other in _other_arms(source, space) for name in FLEXARM_NODES]
    for pattern in source.keys:
        if not any(_matches(pattern, name) for name in (*known, *others)):
            raise ConfigError(f"{source.name}: {pattern}: no such node; allowed: /**, {', '.join(known)}")
    here = (node, *(f"{space}/{name}" for name in beside))
    if source.name != COMMAND_LINE and not any(source.keys_for(name) for name in here):
        there = ", ".join(source.keys)
        raise ConfigError(
            f"{source.name}: {there}: holds nothing for {node}; allowed: {', '.join(here)}, /**"
        )


def _other_arms(source: ParameterSource, space: str) -> set[str]:
    """Return the namespaces of other arms: they have a node that the file gives something here, too.

    A name that has no twin here is more likely a mistyped one.
    """
    places = [pattern.rpartition("/")[::2] for pattern in source.keys]
    here = {name for other, name in places if other == space and name in FLEXARM_NODES}
    return {other for other, name in places if name in here}


def _absolute(parts: Sequence[str]) -> str:
    """Return the name of a node as rcl compares it: all are absolute."""
    return "".join(f"/{part.strip('/')}" for part in parts)


def _sections(
    path: Path, content: Mapping[str, Any], around: tuple[str, ...]
) -> Iterator[tuple[tuple[str, ...], tuple[str, ...]]]:
    """Yield the parts of the name of every node, as they are written, and its keys."""
    for part, inside in content.items():
        parts = (*around, part)
        node = _absolute(parts)
        form = f"expected 'node: {HELD}: key: value' with at least one key"
        if not isinstance(inside, dict) or not inside:
            raise ConfigError(f"{path}: {node}: {inside!r}: {form}")
        if HELD not in inside:
            yield from _sections(path, inside, parts)
            continue
        values = inside[HELD]
        if len(inside) > 1 or not isinstance(values, dict) or not values:
            raise ConfigError(f"{path}: {node}: {inside!r}: {form}")
        keys = tuple(_dotted(f"{path}: {node}", values))
        if twice := sorted({key for key in keys if keys.count(key) > 1}):
            raise ConfigError(f"{path}: {node}: {twice[0]}: is given twice, nested and dotted; give it once")
        yield parts, keys


def _dotted(place: str, values: Mapping[Any, Any], before: str = "") -> Iterator[str]:
    for key, value in values.items():
        name = f"{before}{key}"
        if value is None or value == {}:
            raise ConfigError(f"{place}: {name}: has no value; give one, or leave the key out")
        if isinstance(value, list) and any(isinstance(item, list | dict) for item in value):
            raise ConfigError(f"{place}: {name}: {value!r}: expected a list of single values")
        if isinstance(value, dict):
            yield from _dotted(place, value, f"{name}.")
        else:
            yield name


def _matches(pattern: str, node: str) -> bool:
    """Return whether rcl gives a node what stands under ``pattern``."""
    text = re.escape(pattern).replace(r"/\*\*", "(?:/.*)?").replace(r"\*", "[^/]+")
    return re.fullmatch(text, node) is not None
