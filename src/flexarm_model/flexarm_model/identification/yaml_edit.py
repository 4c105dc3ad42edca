"""Values of a YAML file changed in place: everything else, comments too, stays as people wrote it.

What an anchor (``&name``) and its aliases (``*name``) share is written out where a value in it changes: one
path is one value, as it is when the file is read.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import Any

import yaml

from flexarm_model.settings.strict_yaml import ConfigError


def edit_values(text: str, changes: Mapping[str, str | float], preset: str = "") -> str:
    """Return the text with scalars changed, each by its dotted path.

    A value that the preset overlays is changed there, as that is the one in force.

    Raises:
        ConfigError: A path leads to no scalar, two to the same, or to one that cannot be changed in place.
    """
    paths = [_path_in_force(text, dotted, preset) for dotted in changes]
    edited = _write_out_aliases(text, paths)
    root = _compose(edited)
    nodes = [_find(root, path) for path in paths]
    asked = dict(zip(nodes, changes.values(), strict=True))
    if len(asked) < len(nodes):
        raise ConfigError(f"{', '.join(changes)}: name a value twice; give it once")
    ways = {way: asked[leaf] for way, leaf in _leaves(root) if leaf in asked}
    for node in sorted(nodes, key=lambda node: node.start_mark.index, reverse=True):
        edited = _replaced(edited, node, asked[node])
    if _values(edited) != {**_values(text), **ways}:
        raise ConfigError(f"{', '.join(changes)}: cannot be changed as the file is written")
    return edited


def edit_names(text: str, keys: Collection[str], rename: Callable[[str], str]) -> str:
    """Return the text of a description whose bodies, those of presets too, have other names of files.

    Args:
        text: Of a description.
        keys: What names of files stand under; of a dotted path its last part counts.
        rename: The new name from the old one.
    """
    names = {
        value.start_mark.index: value
        for part in ("bodies", "presets")
        for node in _walk(_find(_compose(text), [part]))
        if isinstance(node, yaml.MappingNode)
        for key, value in node.value
        if isinstance(value, yaml.ScalarNode) and key.value.rpartition(".")[2] in keys
    }
    for _, node in sorted(names.items(), reverse=True):
        if (new := rename(node.value)) != node.value:
            text = _replaced(text, node, new)
    return text


def add_items(text: str, key: str, items: Sequence[str]) -> str:
    """Return the text with more items in the top-level list ``key``, which is made when it is missing.

    Raises:
        ConfigError: There is something else than a list, or one that cannot be added to as it is written.
    """
    node = _find(_compose(text), [key])
    old = yaml.safe_load(text)[key] if node is not None else []
    if not isinstance(old or [], list):
        raise ConfigError(f"'{key}': is not a list")
    if node is None:
        end = _end_of_document(text)
        added = text[:end].rstrip("\n") + f"\n\n{key}:\n" + _block(items, 2) + text[end:]
    elif not old or node.flow_style:
        line = _one_line([*(old or []), *items])
        added = f"{text[: node.start_mark.index].rstrip(' ')} {line}{text[node.end_mark.index :]}"
    else:
        text = text if text.endswith("\n") else text + "\n"
        end = text.index("\n", node.value[-1].end_mark.index - 1) + 1
        added = text[:end] + _block(items, node.start_mark.column) + text[end:]
    if _read(added, key) != [*(old or []), *items]:
        raise ConfigError(f"'{key}': cannot be added to as it is written")
    return added


def _read(text: str, key: str) -> Any:
    """Return a value of the top level; None where the text is not YAML."""
    try:
        return yaml.safe_load(text)[key]
    except yaml.YAMLError:
        return None


def _end_of_document(text: str) -> int:
    """Return where "..." stands; without it the end of the text."""
    for event in yaml.parse(text):
        if isinstance(event, yaml.DocumentEndEvent) and event.explicit and event.start_mark is not None:
            return event.start_mark.index
    return len(text)


def _replaced(text: str, node: yaml.ScalarNode, value: Any) -> str:
    """Return the text with another value for a scalar; blank lines and the indent behind it stay.

    The end mark of one in block style, behind "|" or ">", is at what comes next.
    """
    start = node.start_mark.index
    end = start + len(text[start : node.end_mark.index].rstrip())
    return text[:start] + _one_line(value) + text[end:]


def _values(text: str) -> dict[tuple[str, ...], Any]:
    """Return the value of every scalar by the keys that lead to it; none where the text is not YAML."""
    try:
        return {way: _Loader("").construct_document(leaf) for way, leaf in _leaves(_compose(text))}
    except yaml.YAMLError:
        return {}


def _leaves(node: Any, way: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], yaml.ScalarNode]]:
    """Yield every scalar with the keys that lead to it, those behind aliases too."""
    if isinstance(node, _Alias):
        yield from _leaves(node.value, way)
    elif isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            yield from _leaves(value, (*way, key.value))
    elif isinstance(node, yaml.SequenceNode):
        for i, value in enumerate(node.value):
            yield from _leaves(value, (*way, str(i)))
    elif node is not None:
        yield way, node


def _block(items: Sequence[str], column: int) -> str:
    """Return a list with one item per line."""
    return "".join(f"{' ' * column}- {_one_line(item)}\n" for item in items)


def _path_in_force(text: str, dotted: str, preset: str) -> list[str]:
    """Return the keys that lead to a value: the preset's where it overlays it.

    Raises:
        ConfigError: They lead to no scalar.
    """
    root, parts = _compose(text), dotted.split(".")
    ways = [["presets", preset, ".".join(parts[:k]), *parts[k:]] for k in range(len(parts), 0, -1)]
    path = next((way for way in ways if preset and _find(root, way[:3]) is not None), parts)
    if not isinstance(_find(root, path), yaml.ScalarNode):
        raise ConfigError(f"'{dotted}': no such value in the file")
    return path


def _write_out_aliases(text: str, paths: Sequence[Sequence[str]]) -> str:
    """Return the text without the aliases on the way to values, and of what holds one of the values."""
    while True:
        root = _compose(text)
        ways = [_way(root, path) for path in paths]
        alias = next((node for way in ways for node in way if isinstance(node, _Alias)), None)
        if alias is None:
            places = [way[-1].start_mark.index for way in ways]
            of_values = (
                node
                for node in _walk(root)
                if isinstance(node, _Alias) and any(node.stands_for(place) for place in places)
            )
            alias = next(of_values, None)
        if alias is None:
            return text
        value = _Loader("").construct_document(alias.value)
        text = text[: alias.start_mark.index] + _one_line(value) + text[alias.end_mark.index :]


class _Alias(yaml.Node):
    """An alias in the tree of a text, where PyYAML puts what it stands for; its value is that node."""

    def __init__(self, value: Any, event: Any) -> None:
        """Keep what it stands for, and where it is."""
        super().__init__("!alias", value, event.start_mark, event.end_mark)

    def stands_for(self, place: int) -> bool:
        """Return whether it stands for what is at a place of the text, among others."""
        return bool(self.value.start_mark.index <= place < self.value.end_mark.index)


class _Loader(yaml.SafeLoader):
    """Keeps aliases in the tree."""

    def compose_node(self, parent: Any, index: Any) -> Any:
        """Return the next node."""
        event: Any = self.peek_event()  # type: ignore[no-untyped-call]
        node = super().compose_node(parent, index)
        return _Alias(node, event) if isinstance(event, yaml.AliasEvent) else node


_Loader.add_constructor("!alias", lambda loader, node: loader.construct_object(node.value, deep=True))


def _compose(text: str) -> Any:
    """Return the tree of a text; None of an empty one."""
    return yaml.compose(text, Loader=_Loader)


def _walk(node: Any) -> Iterator[Any]:
    """Yield a node and all that is written in it."""
    yield node
    if isinstance(node, yaml.CollectionNode):
        for item in node.value:
            for part in item if isinstance(item, tuple) else (item,):
                yield from _walk(part)


def _find(root: Any, keys: Sequence[str]) -> Any:
    """Return the node that keys lead to; None where they lead nowhere."""
    return next(iter(_way(root, keys)[::-1]), None)


def _way(node: Any, keys: Sequence[str]) -> list[Any]:
    """Return the nodes on the way that keys lead, aliases among them; none where they lead nowhere."""
    way = [node]
    for key in (*keys, None):
        if isinstance(node, _Alias):
            way.append(node := node.value)
        if key is None:
            return way
        if isinstance(node, yaml.MappingNode):
            node = next((value for name, value in node.value if name.value == key), None)
        elif isinstance(node, yaml.SequenceNode) and key.isdigit() and int(key) < len(node.value):
            node = node.value[int(key)]
        else:
            return []
        way.append(node)
    return way


class _Dumper(yaml.SafeDumper):
    """Writes what is there several times as often."""

    def ignore_aliases(self, data: object) -> bool:
        """Return that nothing is written as an alias."""
        return True


def _one_line(value: Any) -> str:
    """Write a value on one line, quoted where YAML would read something else."""
    text = yaml.dump(
        value, Dumper=_Dumper, default_flow_style=True, sort_keys=False, width=10**6, allow_unicode=True
    )
    return text.removesuffix("\n").removesuffix("\n...")
