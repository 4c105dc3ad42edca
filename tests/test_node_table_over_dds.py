"""The table of nodes in docs names the topics and services that the running nodes have, and no others."""

from __future__ import annotations

import re
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

import pytest

from flexarm_bringup.processes.graph import Process, rig_graph, with_drift, with_markers
from flexarm_bringup.processes.running_graph_node import Ear, WaitedTooLong, running
from flexarm_bringup.rig_run.watch_node import WatchNode
from flexarm_bringup.topics import NAMESPACE

pytestmark = pytest.mark.ros

PAGE = Path(__file__).resolve().parents[1] / "docs" / "nodes.md"
SEEN = 60.0  # s until DDS has told everything, where others use the cores
# what every node has, and the clock of lockstep, which the text below the table tells
COMMON = re.compile(r"/rosout|/parameter_events|/diagnostics|.*/(ready|transition_event)")
COMMON_SERVICES = ("rcl_interfaces/", "lifecycle_msgs/", "type_description_interfaces/")
FAMILY = re.compile(r"(imu|camera)/.+")

Row = dict[str, set[str]]


def table() -> dict[str, Row]:
    """Return by node what the page says, relative to /flexarm."""
    rows = {}
    for line in PAGE.read_text(encoding="utf8").splitlines():
        cells = [cell.strip() for cell in line.split("|")[1:-1]]
        if len(cells) == 4 and re.fullmatch(r"`\w+`", cells[0]) and "`" in cells[1] + cells[2]:
            node = cells[0].strip("`")
            offered, _, called = cells[3].partition("calls")
            parts = {"publisher": cells[1], "subscriber": cells[2], "service": offered, "client": called}
            rows[node] = {kind: named(text, node) for kind, text in parts.items()}
    return rows


def named(text: str, node: str) -> set[str]:
    names = re.findall(r"`([~\w/<>]+)`", text)
    return {relative(name.replace("~", node)) for name in names if not COMMON.fullmatch(name)}


def relative(name: str) -> str:
    """Return a topic relative to /flexarm; of sensors of which an arm may have several, the family."""
    return FAMILY.sub(r"\1/<name>", name.removeprefix(f"{NAMESPACE}/"))


def found(ear: Ear, node: str) -> Row:
    """Return what a running node has."""
    kinds = ("publisher", "subscriber", "service", "client")
    rows = {kind: getattr(ear.node, f"get_{kind}_names_and_types_by_node")(node, NAMESPACE) for kind in kinds}
    own = {kind: relatives(row) for kind, row in rows.items()}
    own["subscriber"] -= {"tick"}
    return own


def relatives(row: Iterable[tuple[str, list[str]]]) -> set[str]:
    return {
        relative(name)
        for name, types in row
        if not COMMON.fullmatch(name) and not types[0].startswith(COMMON_SERVICES)
    }


def assert_told(ear: Ear, nodes: Iterable[str]) -> None:
    told, names = table(), set(nodes)
    names -= {"recorder"}  # it hears the table of topics
    assert names <= set(told)

    def is_told() -> bool:
        present = {name for name, _ in ear.node.get_node_names_and_namespaces()}
        return names <= present and all(found(ear, name) == told[name] for name in names)

    with suppress(WaitedTooLong):
        ear.wait(is_told, SEEN, "the nodes to be as told")
    for name in sorted(names):
        assert found(ear, name) == told[name], name


def test_the_table_tells_the_running_rig(tmp_path: Path) -> None:
    graph = with_drift(with_markers(rig_graph()), None)
    with running(graph, (), tmp_path) as (_, ear):
        ear.wait_ready(*(row.name for row in graph))
        assert_told(ear, (row.name for row in graph))


def test_the_table_tells_who_comes_for_a_while(tmp_path: Path) -> None:
    names = ("commander", "excite")
    graph = tuple(Process("flexarm_bringup", f"{name}_node", name) for name in names)
    with running(graph, (), tmp_path) as (_, ear):
        watch = WatchNode(("rig",), lambda text: None)
        try:
            assert_told(ear, (*names, "watch"))
        finally:
            watch.end()


def test_every_row_is_of_a_node_that_is_compared() -> None:
    running_rows = {row.name for row in with_drift(with_markers(rig_graph(bag="bag")), None)}
    assert set(table()) == running_rows | {"commander", "excite", "watch"}
