"""Who answers a service does not wait in the middleware for a client that cannot hear it."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import pytest

pytestmark = pytest.mark.ros
rclpy = pytest.importorskip("rclpy")

from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from rclpy.qos import DurabilityPolicy, QoSProfile  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402

from flexarm_model.ros import patient_answers_node  # noqa: E402
from flexarm_model.ros.managed_node import LifeSettings, ManagedNode  # noqa: E402
from flexarm_model.ros.patient_answers_node import LateAnswer, reader_of  # noqa: E402
from flexarm_model.ros.tidy_node import TidyNode  # noqa: E402

VOLATILE, LASTING = DurabilityPolicy.VOLATILE, DurabilityPolicy.TRANSIENT_LOCAL


class Asked:
    """A node with one service, and clients beside it."""

    def __init__(self) -> None:
        self.node, self.others = TidyNode("asked"), rclpy.create_node("asking")
        self.executor, self.sent, self.said = SingleThreadedExecutor(), list[Any](), list[str]()
        self.service = self.node.create_service(Trigger, "~/ask", self._answer)
        answers = self.node._answers[self.service]
        sending = answers._send
        answers._send = lambda response, header: (self.sent.append(header), sending(response, header))
        self.node.get_logger = lambda: SimpleNamespace(warning=self.said.append)  # type: ignore[method-assign]
        for each in (self.node, self.others):
            self.executor.add_node(each)

    def _answer(self, _: Any, response: Any) -> Any:
        response.success = True
        return response

    def call(self, durability: DurabilityPolicy, until: Any) -> Any:
        """Call from a client of this quality and spin until something holds, or for 10 s."""
        profile = QoSProfile(depth=10, durability=durability)
        client = self.others.create_client(Trigger, "/asked/ask", qos_profile=profile)
        assert durability == LASTING or client.wait_for_service(10.0)  # it is never ready for the other
        future, end = client.call_async(Trigger.Request()), time.monotonic() + 10.0
        while not until(future) and time.monotonic() < end:
            self.executor.spin_once(timeout_sec=0.05)
        self.others.destroy_client(client)
        return future


@pytest.fixture
def asked() -> Iterator[Asked]:
    rclpy.init(domain_id=int(os.environ.get("ROS_DOMAIN_ID", "0")))
    made = Asked()
    yield made
    made.executor.shutdown()
    for node in (made.node, made.others):
        node.destroy_node()
    rclpy.shutdown()


def test_who_can_hear_is_answered_and_known_by_its_request(asked: Asked) -> None:
    future = asked.call(VOLATILE, lambda future: future.done())
    assert future.result().success
    assert len(reader_of(asked.sent[0])) == 16 and not asked.said


def test_nothing_is_sent_to_who_cannot_hear_and_the_log_says_so(
    asked: Asked, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It blocked the guard for 100 ms, and with it the whole process: the armed arm was stopped."""
    monkeypatch.setattr(patient_answers_node, "PATIENCE", 0.2)
    future = asked.call(LASTING, lambda _: asked.said)
    assert not future.done() and not asked.sent
    assert asked.said[0].startswith("/asked/ask: no answer sent: who asked cannot hear it")
    assert asked.call(VOLATILE, lambda future: future.done()).result().success  # others are not kept waiting


def test_an_answer_waits_until_its_reader_is_discovered(asked: Asked) -> None:
    answers, looks = asked.node._answers[asked.service], list[bytes]()
    is_there = answers._is_there
    answers._is_there = lambda reader: looks.append(reader) or (len(looks) > 3 and is_there(reader))
    assert asked.call(VOLATILE, lambda future: future.done()).result().success
    assert len(looks) == 4 and not answers._kept and asked.node._retrying.is_canceled()


def test_an_answer_that_is_not_known_yet_is_sent_when_it_is(asked: Asked) -> None:
    late, asks = LateAnswer(), list[Any]()
    asked.node._until_gone[asked.service]._callback = lambda request, _: asks.append(request) or late
    future = asked.call(VOLATILE, lambda future: asks)
    assert asks and not future.done() and not asked.sent
    client = asked.others.create_client(Trigger, "/asked/ask")
    assert client.wait_for_service(10.0)
    future, end = client.call_async(Trigger.Request()), time.monotonic() + 10.0
    while len(asks) < 2 and time.monotonic() < end:
        asked.executor.spin_once(timeout_sec=0.05)
    late.give(Trigger.Response(success=True))
    while not future.done() and time.monotonic() < end:
        asked.executor.spin_once(timeout_sec=0.05)
    assert future.result().success and len(asked.sent) == 1


def test_an_answer_that_becomes_known_after_its_service_has_gone_is_not_sent(asked: Asked) -> None:
    late, asks = LateAnswer(), list[Any]()
    asked.node._until_gone[asked.service]._callback = lambda request, _: asks.append(request) or late
    asked.call(VOLATILE, lambda future: asks)
    asked.node.destroy_service(asked.service)
    late.give(Trigger.Response(success=True))
    assert not asked.sent


def test_an_answer_that_waits_goes_with_its_service(asked: Asked) -> None:
    answers = asked.node._answers[asked.service]
    asked.call(LASTING, lambda _: answers._kept)
    asked.node.destroy_service(asked.service)
    end = time.monotonic() + 0.1
    while time.monotonic() < end:
        asked.executor.spin_once(timeout_sec=0.02)
    assert not asked.sent and not answers._kept


def test_an_answer_of_the_lifecycle_waits_on_when_what_belongs_to_activity_goes() -> None:
    """Its timer was destroyed with the node's activity: such a service never answered late again."""
    rclpy.init(domain_id=int(os.environ.get("ROS_DOMAIN_ID", "0")))
    node = ManagedNode("waiting")
    node.start(LifeSettings())
    answers = next(a for s, a in node._answers.items() if s.service_name.endswith("get_state"))
    sent: list[Any] = []
    answers._send, answers._is_there = lambda *args: sent.append(args), lambda reader: not node.is_active
    answers._kept.append((time.monotonic() + 10.0, b"reader", "response", "header"))
    answers._wake()
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    executor.spin_once(timeout_sec=0.05)
    assert node.is_active and not sent
    node.trigger_deactivate()
    end = time.monotonic() + 10.0
    while not sent and time.monotonic() < end:
        executor.spin_once(timeout_sec=0.05)
    assert sent == [("response", "header")]
    executor.shutdown()
    node.destroy_node()
    rclpy.shutdown()


def test_every_service_of_a_node_is_patient_those_of_its_lifecycle_too(asked: Asked) -> None:
    names = {service.service_name.rsplit("/", 1)[1] for service in asked.node.services}
    assert {"ask", "get_state", "change_state", "get_parameters"} <= names
    assert all(service.send_response == asked.node._answers[service].send for service in asked.node.services)


def test_what_is_no_request_has_no_reader() -> None:
    assert reader_of(SimpleNamespace(sequence_number=1)) == reader_of(object()) == b""
