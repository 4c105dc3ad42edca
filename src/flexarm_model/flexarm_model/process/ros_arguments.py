"""The ROS part of a command line, read without ROS: ``--ros-args -r __node:=left -p rate:=2.0 --``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

_REMAP = ("-r", "--remap")
_KINDS = {"__node": "node", "__name": "node", "__ns": "space"}


def values_of(arguments: Sequence[str], options: Sequence[str]) -> Iterator[str]:
    """Yield what follows one of the options in the ROS part of a command line."""
    inside = False
    for option, value in zip(arguments, (*arguments[1:], ""), strict=True):
        inside = option == "--ros-args" or (inside and option != "--")
        if inside and option in options:
            yield value


def node_name(name: str, space: str, arguments: Sequence[str]) -> str:
    """Return the full name that rcl gives a node; its first fitting rule counts.

    Args:
        name: Of the node before it is renamed.
        space: Its namespace, without slashes.
        arguments: Command line.
    """
    found = {"node": name, "space": f"/{space}"}
    for rule in reversed(list(values_of(arguments, _REMAP))):
        before, _, after = rule.partition(":=")
        node, _, kind = before.rpartition(":")
        if kind in _KINDS and node in ("", name):
            found[_KINDS[kind]] = after
    return f"{found['space'].rstrip('/')}/{found['node']}"


def domain(environment: Mapping[str, str]) -> str:
    """Return the ROS domain, as rcl reads it; what is no number is left to rcl to refuse."""
    text = environment.get("ROS_DOMAIN_ID") or "0"
    return str(int(text)) if text.isdecimal() else text
