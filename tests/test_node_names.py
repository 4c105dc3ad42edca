"""No node gives an attribute of its own the name of one of rclpy's, which would take its place."""

from __future__ import annotations

import ast
import inspect
import re
from pathlib import Path

import pytest

pytestmark = pytest.mark.ros
Node = pytest.importorskip("rclpy.node", reason="needs ROS").Node

SRC = Path(__file__).resolve().parents[1] / "src"
BASES = {"Node", "ManagedNode", "LifecycleNode", "Caller"}
SHARED = {"_executor"}  # rclpy's own way to keep it is a weak reference of another name


def taken() -> set[str]:
    """Return the private names that rclpy gives its nodes."""
    return set(re.findall(r"self\.(_\w+)\s*(?::[^=\n]+)?=[^=]", inspect.getsource(Node)))


def given(path: Path) -> set[str]:
    """Return the attributes that nodes of a file set."""
    parts: list[ast.AST] = []
    for found in ast.walk(ast.parse(path.read_text(encoding="utf8"))):
        if isinstance(found, ast.ClassDef) and BASES & {ast.unparse(base) for base in found.bases}:
            parts += ast.walk(found)
    stored = [part for part in parts if isinstance(part, ast.Attribute) and isinstance(part.ctx, ast.Store)]
    return {part.attr for part in stored if ast.unparse(part.value) == "self"}


def test_rclpy_has_the_names_that_were_taken_once() -> None:
    assert {"_services", "_parameters", "_clients", "_timers"} <= taken()


@pytest.mark.parametrize("path", sorted(SRC.glob("*/flexarm_*/**/*node*.py")), ids=lambda path: path.stem)
def test_no_attribute_of_a_node_is_one_of_rclpy_s(path: Path) -> None:
    """A model node whose services stood in ``_services`` ended with its first service."""
    assert not given(path) & taken() - SHARED
