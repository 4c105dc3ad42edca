"""The ROS part of a command line, read without ROS: ``--ros-args -r __node:=left -p rate:=2.0 --``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

HIGHEST_DOMAIN = 232  # the ports of the next one are beyond the last, 65535 (DDSI-RTPS, 9.6.1.1)
_REMAP = ("-r", "--remap")
_KINDS = {"__node": "node", "__name": "node", "__ns": "space"}


def values_of(arguments: Sequence[str], options: Sequence[str]) -> Iterator[str]:
    """Yield what follows one of the options in the ROS part of a command line."""
    inside = False
    for option, value in zip(arguments, (*arguments, "")[1:], strict=True):
        inside = option == "--ros-args" or (inside and option != "--")
        if inside and option in options:
            yield value


def asks_help(arguments: Sequence[str]) -> bool:
    """Return whether arguments for the node, not those for ROS, ask for help."""
    return any(argument in ("-h", "--help") for argument in not_for_ros(arguments))


def not_for_ros(arguments: Sequence[str]) -> Iterator[str]:
    """Yield the arguments of a command line outside its ROS part."""
    inside = False
    for argument in arguments:
        was_inside, inside = inside, argument == "--ros-args" or (inside and argument != "--")
        if not (inside or was_inside):
            yield argument


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
    """Return the ROS domain, as rcl reads it.

    Raises:
        ValueError: It is no domain; the message names variable and value and says what is allowed.
    """
    text = environment.get("ROS_DOMAIN_ID") or "0"
    if not (text.isascii() and text.isdigit() and int(text) <= HIGHEST_DOMAIN):
        raise ValueError(f"ROS_DOMAIN_ID: '{text}': expected a whole number, 0 to {HIGHEST_DOMAIN}")
    return str(int(text))
