"""Nodes run an arm with what was chosen for it."""

from __future__ import annotations

import json

import pytest
import yaml

from flexarm_bringup.cli import main
from flexarm_bringup.parameters_command import NODES, parameters_of
from flexarm_bringup.tasks.node_settings import node_settings
from flexarm_bringup.tasks.task_for import task_for

ARMS = ("single_link", "planar_3rrr", "spatial_3tpt", "serial_6r", "variable_stiffness")


@pytest.mark.parametrize("arm", ARMS)
def test_every_setting_of_a_moves_file_reaches_the_node_that_has_it(arm: str) -> None:
    task = task_for(arm)
    given = node_settings(task, task.presets[0])
    chosen = task.under(task.presets[0]).settings
    assert given["estimator"] == chosen["estimator"]
    assert given["controller"].items() >= {**chosen["mpc"], **chosen["motion"]}.items()
    for node, values in given.items():
        assert set(values) <= {item.name for item in parameters_of(node)}


def test_the_control_period_is_that_of_the_arm() -> None:
    periods = [node_settings(task_for(arm), task_for(arm).presets[0])["controller"]["period"] for arm in ARMS]
    assert periods == pytest.approx([0.005, 0.005, 0.001, 0.002, 0.005])


def test_settings_of_a_preset_come_with_it() -> None:
    task = task_for("single_link")
    geared, light = (node_settings(task, preset)["controller"] for preset in ("geared", "light_hub"))
    assert (geared["firm_time"], light["firm_time"]) == (0.4, 0.0)


def test_the_parameter_file_of_an_arm_is_what_its_nodes_get(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["parameters", "--arm", "planar_3rrr"]) == 0
    nodes = yaml.safe_load(capsys.readouterr().out)
    given = node_settings(task_for("planar_3rrr"), "geared")
    for node, values in given.items():
        told = nodes[f"/flexarm/{node}"]["ros__parameters"]
        assert told == {"manipulator": "planar_3rrr", "preset": "geared", **values}


def test_the_parameter_file_of_an_arm_has_every_node_on_that_arm(capsys: pytest.CaptureFixture[str]) -> None:
    """A node that it left out was of the single link: the drift watch, the markers, the recorder."""
    assert main(["parameters", "--arm", "planar_3rrr"]) == 0
    nodes = {name: node["ros__parameters"] for name, node in yaml.safe_load(capsys.readouterr().out).items()}
    assert set(nodes) == {f"/flexarm/{node}" for node in NODES}
    assert all(own["manipulator"] == "planar_3rrr" and own["preset"] == "geared" for own in nodes.values())
    for node in NODES:
        assert set(nodes[f"/flexarm/{node}"]) <= {item.name for item in parameters_of(node)}
    assert nodes["/flexarm/drift"]["learning"] == 8.0
    replayed = json.loads(nodes["/flexarm/recorder"]["settings"])
    assert replayed == node_settings(task_for("planar_3rrr"), "geared")


@pytest.mark.parametrize(
    "wrong", [["--arm", "no_such_arm"], ["--preset", "geared"], ["--arm", "single_link", "--preset", "x"]]
)
def test_an_arm_or_preset_that_is_not_there_is_told(
    wrong: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["parameters", *wrong]) == 2
    assert capsys.readouterr().err.startswith("flexarm parameters: ")
