"""Nothing is imported that the oldest Python that is supported, 3.10, does not have."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
NEWER = {  # what 3.11 to 3.13 brought, by module ("What's New"); "" is the module itself
    "typing": "Self Never LiteralString Required NotRequired Unpack TypeVarTuple assert_never assert_type "
    "reveal_type dataclass_transform override TypeAliasType ReadOnly TypeIs NoDefault get_overloads "
    "clear_overloads is_protocol get_protocol_members is_typeddict",
    "enum": "StrEnum EnumType ReprEnum verify member nonmember property global_enum EnumCheck FlagBoundary",
    "datetime": "UTC",
    "contextlib": "chdir",
    "itertools": "batched",
    "math": "cbrt exp2 sumprod fma",
    "hashlib": "file_digest",
    "asyncio": "TaskGroup Runner timeout timeout_at Barrier",
    "collections.abc": "Buffer",
    "inspect": "getmembers_static BufferFlags",
    "operator": "call",
    "tomllib": "",
    "wsgiref.types": "",
}


MAY_IMPORT = re.compile(
    "|".join(
        rf"from {re.escape(module)} import (\([^)]*|.*)\b({names.replace(' ', '|')})\b"
        if names
        else re.escape(module)
        for module, names in NEWER.items()
    )
)


def newer_imports(tree: ast.AST) -> Iterator[str]:
    """Yield what a file imports at run time and 3.10 lacks; what is for type checkers only does not count."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING":
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if NEWER.get(alias.name) == "")
        elif isinstance(node, ast.ImportFrom) and node.module in NEWER:
            names = NEWER[node.module].split()
            yield from (f"{node.module}.{a.name}" for a in node.names if not names or a.name in names)
        else:
            yield from newer_imports(node)


@pytest.mark.parametrize("folder", ["src", "tests", "benchmarks", "examples"])
def test_no_file_imports_what_the_oldest_python_lacks(folder: str) -> None:
    files = sorted((ROOT / folder).rglob("*.py"))
    found = {
        str(path.relative_to(ROOT)): names
        for path in files
        if MAY_IMPORT.search(text := path.read_text(encoding="utf-8"))  # parsing all of them takes long
        and (names := list(newer_imports(ast.parse(text))))
    }
    assert not found


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("from typing import Any, Self", ["typing.Self"]),
        ("def f():\n    import tomllib", ["tomllib"]),
        ("from tomllib import loads", ["tomllib.loads"]),
        ("from typing import (\n    Any,\n    Self,\n)", ["typing.Self"]),
        ("if TYPE_CHECKING:\n    from typing import Self", []),
        ("from typing import Literal\nimport math", []),
    ],
)
def test_what_is_newer_is_found(text: str, names: list[str]) -> None:
    assert bool(MAY_IMPORT.search(text)) >= bool(names)
    assert list(newer_imports(ast.parse(text))) == names
