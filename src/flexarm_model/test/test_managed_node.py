"""A managed node that was deactivated hears nothing that its executor had taken before."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any

import pytest

pytestmark = pytest.mark.ros
rclpy = pytest.importorskip("rclpy")

from lifecycle_msgs.msg import Transition  # noqa: E402
from lifecycle_msgs.srv import ChangeState  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402
from std_msgs.msg import Bool  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402

from flexarm_model.ros.declared_node import declare_configs  # noqa: E402
from flexarm_model.ros.managed_node import LifeSettings, ManagedNode  # noqa: E402


class Echo(ManagedNode):
    """Repeats what it hears."""

    SETTINGS = (LifeSettings,)

    def activate(self) -> None:
        self.outlet = self.create_publisher(Bool, "~/said", 1)
        self.made = self.create_subscription(Bool, "~/heard", self.on_bool, 1)
        self.heard: list[bool] = []
        self.offered = self.create_service(Trigger, "~/ask", self.on_ask)
        self.due = self.create_timer(1e3, self.on_time)

    def on_ask(self, request: Any, response: Any) -> Any:
        self.outlet.publish(Bool())
        response.success = True
        return response

    def on_time(self) -> None:
        self.due.cancel()
        self.outlet.publish(Bool())

    def on_bool(self, msg: Any) -> None:
        self.heard.append(msg.data)
        self.outlet.publish(msg)


@pytest.fixture(scope="module")
def echo() -> Iterator[Echo]:
    rclpy.init(domain_id=int(os.environ.get("ROS_DOMAIN_ID", "0")))
    node = Echo("echo_until_gone")
    node.start(*declare_configs(node))
    yield node
    node.destroy_node()
    rclpy.shutdown()


def test_what_was_taken_before_the_end_is_not_heard_after_it(echo: Echo) -> None:
    """It was, and the node ended by a publisher that was gone: one of twenty deactivated controllers."""
    taken, due, kept = echo.made.callback, echo.due.callback, len(echo._until_gone)
    taken(Bool(data=True))
    echo.trigger_deactivate()
    taken(Bool(data=False))
    due()  # a controller ended by the timer of an answer that was late
    assert echo.heard == [True]
    echo.trigger_activate()  # and hears again
    echo.made.callback(Bool(data=True))
    assert echo.heard == [True] and len(echo._until_gone) == kept


def test_what_is_said_last_is_heard_before_its_publisher_goes(echo: Echo) -> None:
    """Of 25 guards that were deactivated three were last heard as armed."""
    waited: list[float] = []
    echo.outlet.wait_for_all_acked = lambda patience: waited.append(patience.nanoseconds * 1e-9)
    echo.trigger_deactivate()
    assert len(waited) == 1 and 0.0 < waited[0] <= 0.1
    assert echo.outlet not in list(echo.publishers)
    echo.trigger_activate()


@pytest.mark.parametrize(("name", "value"), [("use_sim_time", True), ("autostart", False)])
def test_no_parameter_can_be_set_at_run_time(echo: Echo, name: str, value: bool) -> None:
    """Another clock could: it told 0 at once, and its topic went when the node was deactivated."""
    clock, before = echo.get_clock(), echo.get_clock().now().nanoseconds
    (result,) = echo.set_parameters([Parameter(name, value=value)])
    assert not result.successful and result.reason == f"Trying to set a read-only parameter: {name}."
    assert clock.now().nanoseconds >= before and echo.count_subscribers("/clock") == 0


@pytest.mark.parametrize(("number", "label"), [(0, ""), (3, ""), (99, ""), (99, "activate")])
def test_a_transition_that_there_is_not_is_refused_and_the_node_goes_on(
    echo: Echo, number: int, label: str
) -> None:
    """An id raised: one manager that activated an active guard ended it."""
    request = ChangeState.Request(transition=Transition(id=number, label=label))
    answer = echo._service_change_state.callback(request, ChangeState.Response())
    assert not answer.success and echo.is_active


def test_a_transition_that_is_asked_for_by_its_number_is_done(echo: Echo) -> None:
    for number, is_active in (
        (Transition.TRANSITION_DEACTIVATE, False),
        (Transition.TRANSITION_ACTIVATE, True),
    ):
        request = ChangeState.Request(transition=Transition(id=number))
        assert echo._service_change_state.callback(request, ChangeState.Response()).success
        assert echo.is_active == is_active


def test_a_request_that_was_taken_before_the_end_ends_nothing_after_it(echo: Echo) -> None:
    """Sixty resets around a deactivation ended the estimator: its publishers were gone, and its service."""
    offered = echo.offered
    assert offered.callback(Trigger.Request(), Trigger.Response()).success
    echo.trigger_deactivate()
    response = offered.callback(Trigger.Request(), Trigger.Response())
    assert not response.success
    offered.send_response(response, None)
    echo.trigger_activate()
    assert echo.offered.callback(Trigger.Request(), Trigger.Response()).success
