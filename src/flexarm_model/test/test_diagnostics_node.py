"""Statuses of two arms of one domain bear different names on /diagnostics, which they share."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytestmark = pytest.mark.ros
rclpy = pytest.importorskip("rclpy")

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus  # noqa: E402
from rclpy.node import Node  # noqa: E402

from flexarm_model.ros.diagnostics_node import DiagnosticsOutlet  # noqa: E402

SOURCES = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def domain() -> Iterator[None]:
    rclpy.init(domain_id=int(os.environ.get("ROS_DOMAIN_ID", "0")))
    yield
    rclpy.shutdown()


class Sent(list[Any]):
    """A publisher that keeps what it is given."""

    publish = list.append


@pytest.mark.parametrize(
    ("space", "ahead"), [("flexarm", ""), ("/flexarm", ""), ("/", ""), ("left", "left/"), ("a/b", "a/b/")]
)
def test_the_namespace_of_an_arm_is_ahead_of_its_names(domain: None, space: str, ahead: str) -> None:
    """Of two arms the last word about "guard: commands" stood: a stopped arm was told armed."""
    node = Node("guard", namespace=space, start_parameter_services=False)
    outlet = DiagnosticsOutlet(node)
    outlet._publisher = sent = Sent()
    outlet.publish(DiagnosticArray(status=[DiagnosticStatus(name="guard: commands", hardware_id="guard")]))
    node.destroy_node()
    told = [(status.name, status.hardware_id) for array in sent for status in array.status]
    assert told == [(f"{ahead}guard: commands", f"{ahead}guard")]


def test_no_node_publishes_diagnostics_past_it() -> None:
    """The recorder names itself by its namespace."""
    direct = [
        path.name
        for path in SOURCES.glob("flexarm_*/flexarm_*/**/*.py")
        if "create_publisher(DiagnosticArray" in path.read_text("utf8")
    ]
    assert sorted(direct) == ["diagnostics_node.py", "recorder_node.py"]
