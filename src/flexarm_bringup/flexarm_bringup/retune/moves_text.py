"""A moves file with other settings: everything else, comments too, stays as people wrote it."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any

import yaml

from flexarm_model.settings.strict_yaml import ConfigError

Values = Mapping[str, Mapping[str, Any]]
EXACT = 6  # digits of a number
STEP = 2  # spaces
NOTHING = "tag:yaml.org,2002:null"
COMMENT = re.compile("#.*")


def with_settings(text: str, sections: Values, manipulator: str, preset: str = "") -> str:
    """Return the text of a moves file with settings by section, and for another description.

    Args:
        text: The file.
        sections: Values by section of ``settings`` and name; what is there is replaced.
        manipulator: Name or path of the description.
        preset: Whose settings of its own they are; empty for those of all presets.

    Raises:
        ConfigError: The file's sections are not written as mappings.
    """
    where = ("preset_settings", preset) if preset else ("settings",)
    text = _put(text, (), {"manipulator": manipulator})
    for section, values in sections.items():
        if values:
            text = _put(text, (*where, section), values)
    return text


def write_number(value: Any) -> str:
    """Return a setting as YAML 1.1 reads it back; a text in quotes where it would be something else."""
    if isinstance(value, str):
        return value if _reads_back(value) else json.dumps(value, ensure_ascii=False)
    if isinstance(value, float):
        text = f"{value:.{EXACT}g}"
        mantissa, mark, power = text.partition("e")
        return mantissa + ("" if "." in mantissa or not mark else ".0") + mark + power
    if isinstance(value, tuple | list):
        return "[" + ", ".join(map(write_number, value)) + "]"
    return str(value)


def _reads_back(text: str) -> bool:
    """Tell whether a text without quotes is itself for YAML, also within a list or mapping."""
    try:
        return bool(yaml.safe_load(f"[{text}]") == [text])
    except (yaml.YAMLError, ValueError):  # 2024-13-45, say
        return False


def _put(text: str, path: tuple[str, ...], values: Mapping[str, Any]) -> str:
    for name, value in values.items():
        text = _put_one(text, path, name, write_number(value))
    return text


def _put_one(text: str, path: tuple[str, ...], name: str, value: str) -> str:
    """Put one value, and check that nothing else changed by it.

    Raises:
        ConfigError: What leads to it is no mapping, or it cannot be put there alone.
    """
    new = _write_one(text, path, name, value)
    expected = content = _read(text)
    for part in path:
        if content.get(part) is None:
            content[part] = {}
        content = content[part]
    content[name] = yaml.safe_load(value)
    try:
        is_right = _read(new) == expected
    except yaml.YAMLError:
        is_right = False
    if not is_right:
        raise ConfigError(f"'{'.'.join((*path, name))}': cannot be changed as the file is written")
    return new


def _read(text: str) -> Any:
    """Return the content with its aliases written out."""
    return json.loads(json.dumps(yaml.safe_load(text), default=str))


def _write_one(text: str, path: tuple[str, ...], name: str, value: str) -> str:
    node, missing = yaml.compose(text, Loader=yaml.SafeLoader), list(path)
    while missing and (inner := _child(node, missing[0])) is not None:
        node = inner
        missing.pop(0)
    if isinstance(node, yaml.ScalarNode) and node.tag == NOTHING:
        before = text[: node.start_mark.index].rstrip(" ")
        parts = "".join(f"{part}: {{" for part in missing)
        return f"{before} {{{parts}{name}: {value}{'}' * len(missing)}}}{text[node.end_mark.index :]}"
    if not isinstance(node, yaml.MappingNode):
        raise ConfigError(f"'{'.'.join(path)}': is not a mapping that values can be put into")
    old = None if missing else _child(node, name)
    if old is not None:
        return text[: old.start_mark.index] + value + text[_end(old) :]
    if node.flow_style:
        opened = "".join(f"{part}: {{" for part in missing)
        end = node.end_mark.index - 1
        comma = ", " if node.value else ""
        if node.value and "," in COMMENT.sub("", text[node.value[-1][1].end_mark.index : end]):
            comma = " "
        return text[:end] + comma + opened + f"{name}: {value}" + "}" * len(missing) + text[end:]
    return _insert_lines(text, node, [*missing, f"{name}: {value}"])


def _insert_lines(text: str, node: yaml.MappingNode, parts: list[str]) -> str:
    """Put a line, below headings that are missing, behind the first entry of a block mapping."""
    first_key, first_value = node.value[0]
    column = first_key.start_mark.column
    lines = "".join(
        " " * (column + STEP * i) + part + ("" if i == len(parts) - 1 else ":") + "\n"
        for i, part in enumerate(parts)
    )
    at = text.rfind("\n", 0, node.value[1][0].start_mark.index) + 1 if len(node.value) > 1 else 0
    if not at:
        end = text.find("\n", max(_end(first_value) - 1, 0))
        if end < 0:
            return text + "\n" + lines
        at = end + 1
    return text[:at] + lines + text[at:]


def _end(node: Any) -> int:
    """Return where a node ends; a block with its last entry, though YAML says: where the next one begins."""
    if isinstance(node, yaml.CollectionNode) and not node.flow_style and node.value:
        last = node.value[-1]
        return _end(last[1] if isinstance(last, tuple) else last)
    return int(node.end_mark.index)


def _child(node: Any, key: str) -> Any:
    if not isinstance(node, yaml.MappingNode):
        return None
    return next((value for name, value in node.value if name.value == key), None)
