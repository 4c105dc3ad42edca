"""The parameters of a node out of the text of its source, for who must not wait until it is imported.

A node class lists in ``SETTINGS`` the dataclasses whose fields, made with ``parameter``, are its parameters;
one without has those of the classes that it is made from. Names are followed through ``from ... import``.
"""

from __future__ import annotations

import ast
import inspect
import math
import operator
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from flexarm_model.settings.parameters import parameter

_OWN = "flexarm_"  # how packages begin whose names are followed
_BINARY = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
Place = tuple["Source", ast.AST]


class Source:
    """A module as text.

    Attributes:
        text: What it says of itself, its docstring.
        classes: Its classes, by name.
    """

    def __init__(self, module: str) -> None:
        """Read a module; of its packages only ``__init__`` is imported."""
        found = find_spec(module)
        assert found is not None and found.origin is not None
        tree = ast.parse(Path(found.origin).read_text(encoding="utf-8"))
        self.text = ast.get_docstring(tree) or ""
        self.classes = {item.name: item for item in tree.body if isinstance(item, ast.ClassDef)}
        self._names: dict[str, ast.AST] = {**self.classes, **_assigned(tree.body)}
        self._imported = {
            alias.asname or alias.name: (item.module, alias.name)
            for item in tree.body
            if isinstance(item, ast.ImportFrom) and (item.module or "").startswith(_OWN)
            for alias in item.names
        }

    def find(self, name: str) -> Place | None:
        """Return where a name is defined; None where that is in no package of ours."""
        if name in self._names:
            return self, self._names[name]
        module, there = self._imported.get(name, (None, ""))
        return Source(module).find(there) if module else None

    def value(self, node: ast.AST) -> Any:
        """Return the value of a constant expression.

        Raises:
            ValueError: It is none.
        """
        if isinstance(node, ast.Tuple | ast.Dict):  # of a dict its keys: ``tuple(KINDS)`` asks for them
            parts = node.elts if isinstance(node, ast.Tuple) else node.keys
            return tuple(self.value(part) for part in parts if part)
        if isinstance(node, ast.Call) and ast.unparse(node.func) == "tuple":
            return self.value(*node.args)
        if isinstance(node, ast.BinOp) and type(node.op) in _BINARY:
            return _BINARY[type(node.op)](self.value(node.left), self.value(node.right))
        if isinstance(node, ast.Name) and (place := self.find(node.id)):
            return place[0].value(place[1])
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            return self._attribute(node.value.id, node.attr)
        return ast.literal_eval(node)  # type: ignore[arg-type]  # refuses what is no literal

    def _attribute(self, name: str, attribute: str) -> Any:
        """Return ``name.attribute``: of ``math``, or of a class of ours."""
        if name == "math":
            return getattr(math, attribute)
        owner = self.find(name)
        if owner is None or not isinstance(owner[1], ast.ClassDef):
            raise ValueError(f"{name}.{attribute} is no constant")
        return owner[0].value(_assigned(owner[1].body)[attribute])


def node_parameters(source: Source) -> dict[str, Any]:
    """Return ``dataclasses.Field`` by name of the parameters of all nodes in a module."""
    found = {}
    for item in source.classes.values():
        for owner, settings in _settings(source, item):
            found.update(_fields(owner, settings))
    return found


def _settings(source: Source, item: ast.ClassDef) -> Iterator[tuple[Source, ast.ClassDef]]:
    """Yield the settings classes of a node, or of the nodes that it is made from."""
    listed = _assigned(item.body).get("SETTINGS")
    if isinstance(listed, ast.Tuple):
        yield from _classes(source, listed.elts)
    else:
        for owner, parent in _classes(source, item.bases):
            yield from _settings(owner, parent)


def _fields(source: Source, item: ast.ClassDef) -> dict[str, Any]:
    """Return the fields of a settings class, inherited ones first."""
    found = {}
    for owner, parent in _classes(source, item.bases):
        found.update(_fields(owner, parent))
    bound = inspect.signature(parameter)
    for name, call in _assigned(item.body).items():
        if isinstance(call, ast.Call) and ast.unparse(call.func) == "parameter":
            given = {word.arg or "": source.value(word.value) for word in call.keywords}
            values = bound.bind(*map(source.value, call.args), **given)
            found[name] = parameter(*values.args, **values.kwargs)
    return found


def _classes(source: Source, names: list[ast.expr]) -> Iterator[tuple[Source, ast.ClassDef]]:
    for name in names:
        place = source.find(name.id) if isinstance(name, ast.Name) else None
        if place is not None and isinstance(place[1], ast.ClassDef):
            yield place[0], place[1]


def _assigned(body: list[ast.stmt]) -> dict[str, ast.AST]:
    """Return what names are set to in a module or class."""
    found: dict[str, ast.AST] = {}
    for item in body:
        targets = item.targets if isinstance(item, ast.Assign) else []
        if isinstance(item, ast.AnnAssign) and item.value is not None:
            targets = [item.target]
        for target in targets:
            if isinstance(target, ast.Name):
                found[target.id] = item.value  # type: ignore[attr-defined]
    return found
