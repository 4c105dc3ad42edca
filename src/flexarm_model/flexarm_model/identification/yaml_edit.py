"""Values of a YAML file changed in place: everything else, comments too, stays as people wrote it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import yaml

from flexarm_model.settings.strict_yaml import ConfigError


def edit_values(text: str, changes: Mapping[str, str | float], preset: str = "") -> str:
    """Return the text with scalars changed, each by its dotted path.

    A value that the preset overlays is changed there, as that is the one in force.

    Raises:
        ConfigError: A path leads to no scalar.
    """
    edits = []
    for dotted, value in changes.items():
        root = yaml.compose(text, Loader=yaml.SafeLoader)
        overlay = _find(root, ["presets", preset, dotted]) if preset else None
        node = overlay or _find(root, dotted.split("."))
        if not isinstance(node, yaml.ScalarNode):
            raise ConfigError(f"'{dotted}': no such value in the file")
        edits.append((node.start_mark.index, node.end_mark.index, _scalar(value)))
    for start, end, new in sorted(edits, reverse=True):
        text = text[:start] + new + text[end:]
    return text


def add_items(text: str, key: str, items: Sequence[str]) -> str:
    """Return the text with more items in the top-level list ``key``, which is made when it is missing."""
    lines = [f"  - {_scalar(item)}\n" for item in items]
    root = yaml.compose(text, Loader=yaml.SafeLoader)
    node = _find(root, [key])
    if not isinstance(node, yaml.SequenceNode) or node.flow_style or not node.value:
        if node is not None:
            raise ConfigError(f"'{key}': is not a list with one item per line")
        return text.rstrip("\n") + f"\n\n{key}:\n" + "".join(lines)
    end = text.index("\n", node.value[-1].end_mark.index - 1) + 1
    return text[:end] + "".join(lines) + text[end:]


def _find(node: Any, keys: Sequence[str]) -> Any:
    for key in keys:
        if isinstance(node, yaml.MappingNode):
            node = next((value for name, value in node.value if name.value == key), None)
        elif isinstance(node, yaml.SequenceNode) and key.isdigit() and int(key) < len(node.value):
            node = node.value[int(key)]
        else:
            return None
    return node


def _scalar(value: str | float) -> str:
    """Write a value on one line, quoted where YAML would read something else."""
    text = yaml.safe_dump(value, default_flow_style=True, width=10**6, allow_unicode=True)
    return text.removesuffix("\n").removesuffix("\n...")
