"""Estimator and controller in one process: the table changes, each stays the node it is alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TextIO

import pytest
import yaml

from flexarm_bringup.processes import doubles
from flexarm_bringup.processes.composition import TOGETHER, composed, node_names, process_arguments
from flexarm_bringup.processes.graph import rig_graph, ros_arguments, with_markers

GIVEN = {"controller": {"period": 0.002, "law": "mpc", "delay_periods": 2}, "estimator": {"gate": 30.0}}


def test_only_the_two_share_a_process_and_every_node_is_still_there() -> None:
    apart = rig_graph("arm.yaml", "geared", bag="b", settings=GIVEN)
    graph = composed(apart)
    assert [row.name for row in graph] == ["recorder", "model", "composed", "guard", "rig"]
    assert node_names(graph) == node_names(apart)
    assert [row for row in graph if not row.members] == [row for row in apart if row.name not in TOGETHER]
    assert with_markers(graph)[-1].parameters == with_markers(apart)[-1].parameters


def test_both_keep_their_names_and_parameters(tmp_path: Path) -> None:
    apart = rig_graph("arm.yaml", "geared", settings=GIVEN)
    (both,) = (row for row in composed(apart) if row.members)
    arguments = process_arguments(both, tmp_path)
    assert "__node:=" not in " ".join(arguments)
    nodes = yaml.safe_load(Path(arguments[-1]).read_text(encoding="utf8"))
    assert nodes == {
        f"/flexarm/{row.name}": {"ros__parameters": dict(row.parameters)}
        for row in apart
        if row.name in TOGETHER
    }
    assert nodes["/flexarm/controller"]["ros__parameters"]["period"] == 0.002


def test_a_topic_is_renamed_for_the_node_alone_that_renames_it(tmp_path: Path) -> None:
    apart = [
        replace(row, remaps={"strain": "mine"}) if row.name == "estimator" else row for row in rig_graph()
    ]
    (both,) = (row for row in composed(apart) if row.members)
    assert process_arguments(both, tmp_path)[-2:] == ["-r", "estimator:strain:=mine"]


def test_a_process_with_one_node_is_told_as_ever(tmp_path: Path) -> None:
    for row in rig_graph(settings=GIVEN):
        assert process_arguments(row, tmp_path) == ros_arguments(row)
    assert not list(tmp_path.iterdir())


def test_motion_stops_and_the_process_returns_as_for_the_one_that_asks_for_more() -> None:
    apart = [replace(row, respawn=False) if row.name == "controller" else row for row in rig_graph()]
    (both,) = (row for row in composed(apart) if row.members)
    assert both.essential and not both.respawn


@pytest.mark.parametrize("is_there", [True, False])
def test_what_cannot_share_a_process_is_refused(is_there: bool) -> None:
    graph = rig_graph(lockstep=is_there)
    with pytest.raises(ValueError, match="not in lockstep" if is_there else "not both in the graph"):
        composed(graph if is_there else graph[2:])


def test_doubles_of_both_are_looked_for(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    claimed: list[str] = []

    def claim(name: str, domain: str, kind: str = "node") -> TextIO:
        claimed.append(name)
        return (tmp_path / "lock").open("a+")

    monkeypatch.setattr(doubles, "claim_name", claim)
    with doubles.refuse_doubles(composed(rig_graph())):
        pass
    assert claimed == ["/flexarm", *(f"/flexarm/{row.name}" for row in rig_graph())]
