"""Every node that the suite makes is in a policy, or in what refuses to run where security is asked for."""

import ast
import importlib
from collections.abc import Iterator
from pathlib import Path

import pytest
from test_security import NODES, OPERATOR, STARTING, TOOLS

SOURCES = Path(__file__).parents[2]
IN_OWN_DOMAINS = {"soak", "realtime_driver", "ear", "flooder", "forger", "send_times"}
MAKERS = ("Node", "rclpy.create_node", "operate")


@pytest.mark.ros
@pytest.mark.unhurried
def test_every_node_has_a_profile_or_runs_in_a_domain_of_its_own() -> None:
    """The one that looks for a second driver had none: where security is enforced it would hear nobody."""
    found = {name: path for path in sorted(SOURCES.glob("*/flexarm_*/**/*.py")) for name in named_in(path)}
    assert {"model", "echo", "doctor", "goto", "look", "watch", *IN_OWN_DOMAINS} <= found.keys()
    known = {*NODES, *STARTING, *TOOLS, *OPERATOR, *IN_OWN_DOMAINS}
    assert {name: path.name for name, path in found.items() if name not in known} == {}


def named_in(path: Path) -> Iterator[str]:
    """Give the names that a module has for nodes, written out or as a constant that it knows."""
    text = path.read_text(encoding="utf8")
    for call in (node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Call) and node.args):
        made, first = ast.unparse(call.func), call.args[0]
        keywords = {key.arg for key in call.keywords}
        is_node = "namespace" in keywords or "(ManagedNode)" in text
        if made not in MAKERS and not (made == "super().__init__" and is_node):
            continue
        if isinstance(first, ast.Constant):
            yield first.value
        elif isinstance(first, ast.Name) and first.id.isupper():
            parts = path.relative_to(SOURCES).with_suffix("").parts[1:]
            yield getattr(importlib.import_module(".".join(parts)), first.id)
