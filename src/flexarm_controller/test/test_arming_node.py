"""The arming check between messages: what it withholds, and when it says so."""

import os
from types import SimpleNamespace

import pytest

pytest.importorskip("flexarm_interfaces.msg")

from flexarm_interfaces.msg import SteadyFilter  # noqa: E402

from flexarm_controller.laws import LawInputs  # noqa: E402
from flexarm_controller.limits import limits_of  # noqa: E402
from flexarm_controller.margins import arming_node  # noqa: E402
from flexarm_controller.margins.arming import ELSEWHERE  # noqa: E402
from flexarm_controller.margins.arming_node import ArmingCheck  # noqa: E402
from flexarm_controller.margins.gate import Gate  # noqa: E402
from flexarm_controller.settings import ControllerConfig, MarginConfig, MpcConfig  # noqa: E402
from flexarm_model.process import punctual  # noqa: E402
from flexarm_model.reading.config import load_config  # noqa: E402
from flexarm_model.reading.manipulator_file import find_manipulator  # noqa: E402

KEPT, ELSE = SimpleNamespace(model_id="a"), SimpleNamespace(model_id="b")


class Listener:
    """In place of a node: keeps what is published, hears nothing, logs nothing."""

    def __init__(self):
        self.said = []

    def create_publisher(self, kind, topic, quality):
        return SimpleNamespace(publish=lambda msg: self.said.append((topic, getattr(msg, "data", None))))

    def create_subscription(self, *given):
        pass

    def create_timer(self, period, call, **how):
        self.late = call
        return SimpleNamespace(cancel=lambda: None)

    def get_logger(self):
        return SimpleNamespace(error=lambda text: None, info=lambda text: None)


def check_of(monkeypatch, is_live, reasons):
    """Return a check of the single link, its node, its exchange, and what tells the time; KEPT is judged."""
    clock = SimpleNamespace(now=0.0)
    monkeypatch.setattr(Gate, "judge", lambda self, model, filter_: reasons.pop(0))
    monkeypatch.setattr(arming_node.time, "monotonic", lambda: clock.now)
    controller = SimpleNamespace(model=KEPT)
    node = Listener()
    exchange = SimpleNamespace(controller=controller, is_armed=False, is_live=is_live, answer="withheld")
    check = begun(node, exchange)
    check._arming.take(KEPT)
    check.look()
    return check, node, exchange, clock


def begun(node, exchange):
    """Return a check that has just begun."""
    arm = load_config(find_manipulator("single_link"), "geared")
    inputs = LawInputs(limits_of(arm), ControllerConfig(), MpcConfig())
    return ArmingCheck(node, arm, inputs, MarginConfig(), exchange)


@pytest.mark.parametrize("is_live", [True, False])
def test_where_the_arm_stands_elsewhere_the_estimator_is_asked_and_the_guard_is_told_why(
    monkeypatch, is_live
):
    check, node, exchange, clock = check_of(monkeypatch, is_live, ["", "margins: too small"])
    exchange.controller.model, exchange.is_armed = ELSE, True
    check.look()
    exchange.is_armed = False
    for clock.now in (1.0, 1.1, 1.4, 1.5):  # asked once, when it has stood for a moment
        check.look()
    if not is_live:  # in lockstep nothing may depend on a clock
        assert node.said == [("~/margins", "")] and exchange.withheld == ""
        return
    assert exchange.withheld == ELSEWHERE
    assert node.said[1:] == [("~/margins", ELSEWHERE), ("estimator/settle", None)]
    check._arming.take(ELSE)
    check.look()
    assert exchange.withheld == "margins: too small" and node.said[3:] == [("~/margins", exchange.withheld)]


def test_by_the_clock_a_state_is_answered_before_the_loop_is_judged(monkeypatch):
    """A controller that was started again was silent for the 2 s that judging the 3RRR takes."""
    check, node, exchange, clock = check_of(monkeypatch, True, ["", "", ""])
    again = begun(node, exchange)
    node.said.clear()
    exchange.answer = None
    again._arming.take(KEPT)
    again.look()
    assert node.said == [] and not again.is_known
    exchange.answer = "withheld"
    again.look()
    assert node.said == [("~/margins", "")] and again.is_known


def test_without_any_state_the_loop_is_judged_all_the_same(monkeypatch):
    check, node, exchange, clock = check_of(monkeypatch, True, ["", ""])
    again = begun(node, exchange)
    exchange.answer = None
    again._arming.take(KEPT)
    clock.now = arming_node.FIRST
    node.late()
    assert again.is_known


def test_a_filter_that_cannot_be_read_does_not_stop_an_armed_arm(monkeypatch):
    check, node, exchange, _ = check_of(monkeypatch, True, [""])
    assert exchange.withheld == "" and node.said == [("~/margins", "")]
    exchange.is_armed = True
    check.on_filter(SteadyFilter(model_id="a", states=1))  # no matrices
    assert exchange.withheld == "" and len(node.said) == 1
    exchange.is_armed = False
    check.look()
    assert exchange.withheld.startswith("margins: ") and node.said[1:] == [("~/margins", exchange.withheld)]


def test_an_urgent_process_judges_as_any_other(monkeypatch):
    """The controller of a 3RRR kept the estimator, on the same core, from telling any state for 0.7 s."""
    asked = []

    def look(*_):
        asked.append("judged")
        raise ValueError("seen enough")

    monkeypatch.setattr(punctual.os, "sched_getscheduler", lambda thread: os.SCHED_RR)
    monkeypatch.setattr(punctual.os, "sched_getparam", lambda thread: os.sched_param(55))
    monkeypatch.setattr(punctual.os, "sched_setscheduler", lambda _, policy, priority: asked.append(policy))
    monkeypatch.setattr(Gate, "look", look)
    check = begun(Listener(), SimpleNamespace(controller=None, is_armed=False, is_live=True, answer=None))
    check._arming._gate.judge(KEPT, None)
    assert asked[:3] == [os.SCHED_OTHER, "judged", os.SCHED_RR]
