"""The arming check between messages: what it withholds, and when it says so."""

from types import SimpleNamespace

import pytest

pytest.importorskip("flexarm_interfaces.msg")

from flexarm_interfaces.msg import SteadyFilter  # noqa: E402

from flexarm_controller.laws import LawInputs  # noqa: E402
from flexarm_controller.limits import limits_of  # noqa: E402
from flexarm_controller.margins.arming_node import ArmingCheck  # noqa: E402
from flexarm_controller.margins.gate import Gate  # noqa: E402
from flexarm_controller.settings import ControllerConfig, MarginConfig, MpcConfig  # noqa: E402
from flexarm_model.reading.config import load_config  # noqa: E402
from flexarm_model.reading.manipulator_file import find_manipulator  # noqa: E402

KEPT = SimpleNamespace(model_id="a")


class Listener:
    """In place of a node: keeps what is published, hears nothing, logs nothing."""

    def __init__(self):
        self.said = []

    def create_publisher(self, kind, topic, quality):
        return SimpleNamespace(publish=lambda msg: self.said.append((topic, msg.data)))

    def create_subscription(self, *given):
        pass

    def get_logger(self):
        return SimpleNamespace(error=lambda text: None, info=lambda text: None)


def test_a_filter_that_cannot_be_read_does_not_stop_an_armed_arm(monkeypatch):
    arm = load_config(find_manipulator("single_link"), "geared")
    monkeypatch.setattr(Gate, "judge", lambda self, model, filter_: "")
    node, exchange = Listener(), SimpleNamespace(controller=SimpleNamespace(model=KEPT), is_armed=False)
    inputs = LawInputs(limits_of(arm), ControllerConfig(), MpcConfig())
    check = ArmingCheck(node, arm, inputs, MarginConfig(), exchange)
    check._arming.take(KEPT)
    check.look()
    assert exchange.withheld == "" and node.said == [("~/margins", "")]
    exchange.is_armed = True
    check.on_filter(SteadyFilter(model_id="a", states=1))  # no matrices
    assert exchange.withheld == "" and len(node.said) == 1
    exchange.is_armed = False
    check.look()
    assert exchange.withheld.startswith("margins: ") and node.said[1:] == [("~/margins", exchange.withheld)]
