"""Layouts of PlotJuggler, Foxglove and RViz name topics and fields that there are, and nothing else."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
import yaml

pytest.importorskip("flexarm_interfaces", reason="needs ROS and flexarm_interfaces")
pytestmark = pytest.mark.ros

from flexarm_bringup.display.ellipsoid import SIGMAS  # noqa: E402
from flexarm_bringup.message_class import message_class  # noqa: E402
from flexarm_bringup.topics import STREAMS, find_stream  # noqa: E402
from flexarm_model.reading.config import load_config  # noqa: E402
from flexarm_model.reading.manipulator_file import find_manipulator  # noqa: E402

FOLDER = Path(__file__).parents[1] / "config"
AXES = tuple(load_config(find_manipulator("single_link")).actuated)
OF_RVIZ = {"MarkerArray": "visualization_msgs/msg/MarkerArray", "Odometry": "nav_msgs/msg/Odometry"}


def topic_of(path: str) -> str:
    """Return the topic that a path begins with, the longest one that there is."""
    return max((s.name for s in STREAMS if re.match(rf"{s.name}[/.]", path)), key=len, default=path)


def leads_to_a_number(kind: str, fields: list[str]) -> bool:
    """Return whether fields such as "eta[0]" lead from a message to a number."""
    for field in fields:
        name, index = re.fullmatch(r"(\w+)((?:\[\d+\])?)", field).groups()  # type: ignore[union-attr]
        types = message_class(kind).get_fields_and_field_types() if "/" in kind else {}
        if name not in types:
            return False
        listed = re.fullmatch(r"sequence<(.*?)(?:, \d+)?>|(.*)\[\d+\]", types[name])
        if bool(listed) != bool(index):
            return False
        kind = next(filter(None, listed.groups())) if listed else types[name]
        kind = kind.replace("/", "/msg/", 1) if "/" in kind else kind
    return bool(re.fullmatch(r"double|float|u?int\d+|octet|boolean", kind))


def curves_of_plotjuggler() -> Iterator[str]:
    root = ElementTree.parse(FOLDER / "layouts/plotjuggler.xml").getroot()
    yield from (str(curve.get("name")) for curve in root.iter("curve"))


def curves_of_foxglove() -> Iterator[str]:
    panels = json.loads((FOLDER / "layouts/foxglove.json").read_text(encoding="utf8"))["configById"]
    yield from (path["value"] for panel in panels.values() for path in panel.get("paths", ()))


def test_plotjuggler_draws_numbers_that_our_messages_have() -> None:
    curves = list(curves_of_plotjuggler())
    assert len(curves) > 20
    for curve in curves:
        stream = find_stream(topic_of(curve))
        assert stream is not None, curve
        fields = curve[len(stream.name) + 1 :].split("/")
        if stream.type.endswith("/JointState"):  # drawn by the names in it
            assert fields[0] in AXES, curve
            fields = [f"{fields[1]}[0]"]
        assert leads_to_a_number(stream.type, fields), curve


def test_plotjuggler_subscribes_to_what_it_draws() -> None:
    root = ElementTree.parse(FOLDER / "layouts/plotjuggler.xml").getroot()
    topics = {str(topic.get("name")) for topic in root.iter("topic")}
    assert topics == {topic_of(curve) for curve in curves_of_plotjuggler()}


def test_foxglove_draws_numbers_that_our_messages_have() -> None:
    curves = list(curves_of_foxglove())
    assert len(curves) > 20
    for curve in curves:
        stream = find_stream(topic_of(curve))
        assert stream is not None, curve
        assert leads_to_a_number(stream.type, curve[len(stream.name) + 1 :].split(".")), curve


def test_every_panel_of_foxglove_stands_in_its_layout_and_shows_topics_that_there_are() -> None:
    layout = json.loads((FOLDER / "layouts/foxglove.json").read_text(encoding="utf8"))

    def placed(part: Any) -> list[str]:
        return [part] if isinstance(part, str) else placed(part["first"]) + placed(part["second"])

    assert sorted(placed(layout["layout"])) == sorted(layout["configById"])
    for topic in (*layout["configById"]["3D!arm"]["topics"], "/diagnostics"):
        assert find_stream(topic) is not None, topic


def test_rviz_shows_topics_of_the_type_that_its_display_takes() -> None:
    config = yaml.safe_load((FOLDER / "rviz/flexarm.rviz").read_text(encoding="utf8"))[
        "Visualization Manager"
    ]
    assert config["Global Options"]["Fixed Frame"] == "base"
    shown = {}
    for display in config["Displays"]:
        for topic in (display.get("Topic"), display.get("Description Topic")):
            if topic is not None:
                stream = find_stream(topic["Value"])
                assert stream is not None, topic
                shown[display["Class"].split("/")[1]] = stream.type
                assert (topic["Durability Policy"] == "Transient Local") == stream.is_latched
    assert shown == {**OF_RVIZ, "RobotModel": "std_msgs/msg/String"}


def test_rviz_draws_three_standard_deviations_of_the_tip_as_the_markers_do() -> None:
    """Nine were asked for: its scale counts standard deviations, not variances."""
    config = yaml.safe_load((FOLDER / "rviz/flexarm.rviz").read_text(encoding="utf8"))
    displays = config["Visualization Manager"]["Displays"]
    (doubt,) = (display["Covariance"] for display in displays if "Covariance" in display)
    assert [doubt[part]["Scale"] for part in ("Position", "Orientation")] == [SIGMAS, SIGMAS]


@pytest.mark.parametrize(
    ("fields", "found"),
    [
        (["pose", "pose", "position", "x"], True),
        (["pose", "covariance[3]"], True),
        (["pose", "covariance"], False),
        (["pose", "pose"], False),
        (["twist", "speed"], False),
        (["header", "frame_id"], False),
    ],
)
def test_the_check_itself_knows_a_number_from_what_is_none(fields: list[str], found: bool) -> None:
    assert leads_to_a_number("nav_msgs/msg/Odometry", fields) == found
