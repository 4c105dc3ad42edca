"""YAML files whose keys are all texts, each given once, and whose values end.

YAML takes keys such as ``on``, ``1``, ``null`` or a date for something else than text, merges mappings by
``<<``, and lets a value hold itself by an alias. A description means none of this: it is refused, by line.
An alias stands for a copy: who changes what stands in one place does not change it in another. ``1e-3`` is a
number, as it is for ROS and in YAML 1.2. ``010`` is refused: eight in YAML 1.1 and for ROS, ten in YAML 1.2.
"""

from __future__ import annotations

import re
from itertools import accumulate
from pathlib import Path
from typing import Any

import yaml

try:
    from yaml import CSafeLoader as SafeLoader  # libyaml: four times faster
except ImportError:  # PyYAML was built without it
    from yaml import SafeLoader  # type: ignore[assignment]

MOST = 100_000  # values of a file, aliases written out
DEEPEST = 500  # levels; libyaml ends the process where there are very many
_MERGE = "tag:yaml.org,2002:merge"
_LEADING_ZERO = re.compile(r"[-+]?0[0-9_]+")


class ConfigError(ValueError):
    """The description is wrong; the message names file, key, value and what is allowed."""


class StrictLoader(SafeLoader):
    """Safe loader that refuses keys given twice or no text, and values that are not what they look like."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """Return a mapping; ConfigError where a key is given twice, is no text, or merges another mapping."""
        keys = [self._text(key) for key, _ in node.value]
        for key in keys:
            if keys.count(key) > 1:
                raise ConfigError(
                    f"line {node.start_mark.line + 1}: key '{key}' is given twice; give it once"
                )
        return super().construct_mapping(node, deep=deep)

    def construct_object(self, node: yaml.Node, deep: bool = False) -> Any:
        """Return a value; ConfigError where it looks like a date or number and is none, or two numbers."""
        if not isinstance(node, yaml.ScalarNode):
            return super().construct_object(node, deep=deep)  # type: ignore[no-untyped-call]
        if not node.style and _LEADING_ZERO.fullmatch(node.value):  # quoted ones have a style
            raise ConfigError(
                f"line {node.start_mark.line + 1}: '{node.value}' begins with a zero, which is octal to some "
                "and decimal to others; write a number without it, a text in quotes"
            )
        try:
            return super().construct_object(node, deep=deep)  # type: ignore[no-untyped-call]
        except (ValueError, LookupError, AttributeError) as error:
            kind = node.tag.rpartition(":")[2]
            raise ConfigError(
                f"line {node.start_mark.line + 1}: '{node.value}' is read as {kind} and is none ({error}); "
                "write a text in quotes"
            ) from None

    def _text(self, node: yaml.Node) -> str:
        line = f"line {node.start_mark.line + 1}"
        if node.tag == _MERGE:
            raise ConfigError(f"{line}: key '<<': mappings cannot be merged; write their keys out")
        key = self.construct_object(node, deep=True)  # type: ignore[no-untyped-call]
        if not isinstance(key, str):
            written = f"'{node.value}'" if isinstance(node, yaml.ScalarNode) else "a list or mapping"
            raise ConfigError(
                f"{line}: key {written} is read as {key!r}; a key must be text: write it in quotes"
            )
        return key


StrictLoader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)[eE][-+]?[0-9]+$"),
    [*"-+.0123456789"],
)


def read_yaml(path: Path, loader: type[StrictLoader] = StrictLoader) -> dict[str, Any]:
    """Read a YAML file whose top level is a mapping; ``loader`` may know tags of who wrote it.

    Raises:
        ConfigError: It cannot be read, is not YAML, is empty, holds a key twice or one that is no text,
            a whole number that begins with a zero, merges mappings, nests too deeply, holds itself or too
            much.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read ({error.strerror})") from None
    except UnicodeDecodeError:
        raise ConfigError(f"{path}: is not UTF-8 text") from None
    return parse_yaml(text, str(path), loader)


def parse_yaml(text: str, source: str, loader: type[StrictLoader] = StrictLoader) -> dict[str, Any]:
    """Return the mapping that a text holds; ``source`` begins the message of a ConfigError, as a path."""
    try:
        if _levels(text) > DEEPEST:
            raise RecursionError
        content = yaml.load(text, Loader=loader)  # noqa: S506 - a SafeLoader
        if _count_values(content, "", (), {}) > MOST:
            raise ConfigError(f"its aliases stand for more than {MOST} values; write out what is meant")
        content = _write_out(content)
    except ConfigError as error:
        raise ConfigError(f"{source}: {error}") from None
    except yaml.YAMLError as error:
        raise ConfigError(f"{source}: is not YAML: {' '.join(str(error).split())}") from None
    except RecursionError:
        raise ConfigError(
            f"{source}: lists or mappings are nested too deeply; expected a few levels"
        ) from None
    if not isinstance(content, dict):
        raise ConfigError(f"{source}: must hold keys and values at its top level")
    return content


def _levels(text: str) -> int:
    """Return how many levels there may be, by brackets and by dashes on one line."""
    steps = (1 if bracket in "[{" else -1 for bracket in re.findall(r"[\[\]{}]", text))
    brackets = accumulate(steps, lambda level, step: max(level + step, 0))
    dashes = (len(found.split()) for found in re.findall(r"^[ \t]*((?:[-?][ \t]+)+)", text, re.MULTILINE))
    return max(max(brackets, default=0), max(dashes, default=0))


def _count_values(value: object, key: str, around: tuple[int, ...], counted: dict[int, int]) -> int:
    """Return how many values there are with every alias written out.

    Args:
        value: A value of the file, with the key where it stands.
        key: Dotted.
        around: Identities of what holds it.
        counted: By identity, how many are in what has been looked through: an alias is looked through once.

    Raises:
        ConfigError: A value holds itself.
    """
    if not isinstance(value, dict | list):
        return 1
    if id(value) in around:
        raise ConfigError(f"{key}: holds itself by an alias; write its content out")
    if id(value) not in counted:
        inner = value.items() if isinstance(value, dict) else enumerate(value)
        within = (*around, id(value))
        counted[id(value)] = 1 + sum(
            _count_values(item, f"{key}.{name}" if key else str(name), within, counted)
            for name, item in inner
        )
    return counted[id(value)]


def _write_out(value: Any) -> Any:
    """Return a value of which no part is a part of another, too."""
    if isinstance(value, dict):
        return {name: _write_out(item) for name, item in value.items()}
    return [_write_out(item) for item in value] if isinstance(value, list) else value
