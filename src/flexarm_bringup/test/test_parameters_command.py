"""The page of parameters is what the nodes declare."""

import re
from pathlib import Path

import pytest
import yaml

from flexarm_bringup import cli
from flexarm_bringup.parameters_command import NODES, page, parameters_of
from flexarm_model.ros.parameter_file import FLEXARM_NODES

PAGE = Path(__file__).parents[3] / "docs" / "parameters.md"


def test_the_page_in_the_documentation_is_current():
    assert PAGE.read_text() == page(), "run ./flexarm parameters > docs/parameters.md"


def test_the_page_has_every_parameter_of_every_node_once():
    for node, section in zip(NODES, page().split("\n## ")[1:], strict=True):
        names = re.findall(r"^\| `(\w+)`", section, re.M)
        assert section.startswith(node)
        assert names == [item.name for item in parameters_of(node)]
        assert len(set(names)) == len(names)


@pytest.mark.parametrize("node", NODES)
def test_every_parameter_says_what_it_means(node):
    assert all(len(item.metadata["text"]) > 10 for item in parameters_of(node))


def test_one_nodes_parameters_fit_a_terminal_line_each(capsys):
    assert cli.main(["parameters", "estimator"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == len(list(parameters_of("estimator")))
    assert any(line.startswith("gate ") and "[" in line for line in lines)


def test_a_parameter_file_may_name_every_node_that_there_is() -> None:
    assert set(FLEXARM_NODES) == set(NODES)


def test_the_file_of_an_arm_of_ones_own_works_from_any_folder(tmp_path, monkeypatch, capsys):
    (tmp_path / "mine.yaml").write_bytes((PAGE.parent / "two_link.yaml").read_bytes())
    monkeypatch.chdir(tmp_path)
    assert cli.main(["parameters", "--arm", "mine.yaml"]) == 0
    nodes = yaml.safe_load(capsys.readouterr().out)
    told = {node["ros__parameters"].get("manipulator") for node in nodes.values()} - {None}
    assert told == {str(tmp_path / "mine.yaml")}


def test_the_file_of_a_shipped_arm_has_its_name(capsys):
    assert cli.main(["parameters", "--arm", "planar_3rrr"]) == 0
    assert "manipulator: planar_3rrr\n" in capsys.readouterr().out


def test_of_the_file_of_an_arm_one_nodes_part_can_be_had(capsys):
    """The node was read and all were printed."""
    assert cli.main(["parameters", "--arm", "planar_3rrr"]) == 0
    whole = yaml.safe_load(capsys.readouterr().out)
    assert cli.main(["parameters", "guard", "--arm", "planar_3rrr"]) == 0
    assert yaml.safe_load(capsys.readouterr().out) == {"/flexarm/guard": whole["/flexarm/guard"]}
