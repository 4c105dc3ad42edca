"""A running graph of nodes with an ear on its topics: what drills and tests over DDS stand on."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import rclpy
from domain_coordinator import domain_id
from rclpy.qos import QoSProfile
from std_msgs.msg import Bool
from std_srvs.srv import Trigger

from flexarm_bringup.message_class import message_class
from flexarm_bringup.processes.graph import Process
from flexarm_bringup.processes.spinning import MANY, spin_once
from flexarm_bringup.processes.supervisor import Supervisor
from flexarm_bringup.processes.surroundings import HERE, RANGE, defaults
from flexarm_bringup.topics import NAMESPACE, find_stream
from flexarm_model.process.security import check_unsecured
from flexarm_model.ros.node import LATCHED_QOS, events_executor

DEEP_QOS = QoSProfile(depth=5000)  # who listens late must not miss what was said
START_UP = 120.0  # s that nodes may take to be ready; the first start on a machine compiles the arm
ANSWER = 60.0  # s for a service, which takes some ms where nothing else runs


class WaitedTooLong(RuntimeError):
    """Something that was awaited did not happen."""


class Ear:
    """Hears topics of the graph, and can speak on them.

    Attributes:
        heard: Messages by relative topic, in order of arrival.
    """

    def __init__(self, topics: tuple[str, ...]) -> None:
        """Subscribe to relative or absolute topics.

        Raises:
            KeyError: One of them is not a topic of flexarm.
        """
        self.node = rclpy.create_node("ear", namespace=NAMESPACE)
        self._executor = events_executor()
        self._executor.add_node(self.node)
        self.heard: dict[str, list[Any]] = {topic: [] for topic in topics}
        self.ready: dict[str, bool] = {}
        self._clients: dict[str, Any] = {}
        for topic in topics:
            stream = find_stream(topic if topic.startswith("/") else f"{NAMESPACE}/{topic}")
            if stream is None:
                raise KeyError(topic)
            self.node.create_subscription(
                message_class(stream.type), topic, self.heard[topic].append, DEEP_QOS
            )

    def wait(self, condition: Callable[[], bool], seconds: float, what: str) -> None:
        """Listen until ``condition`` holds.

        Raises:
            WaitedTooLong: It does not within ``seconds``; ``what`` says what was awaited.
        """
        deadline = time.monotonic() + seconds
        while not condition():
            if time.monotonic() >= deadline:
                raise WaitedTooLong(f"waited {seconds:g} s for {what}")
            spin_once(self._executor, 0.02, MANY)

    def listen(self, seconds: float) -> None:
        """Listen for a while."""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            spin_once(self._executor, 0.02, MANY)

    def wait_ready(self, *names: str) -> None:
        """Wait until these nodes are ready."""
        for name in names:
            self.ready[name] = False
            self.node.create_subscription(
                Bool,
                f"{name}/ready",
                lambda msg, name=name: self.ready.__setitem__(name, msg.data),
                LATCHED_QOS,
            )
        self.wait(lambda: all(self.ready.values()), START_UP, f"{', '.join(names)} to be ready")

    def call(self, service: str) -> Any:
        """Call a trigger and return its response."""
        return self.ask(Trigger, service, Trigger.Request())

    def ask(self, kind: Any, service: str, request: Any) -> Any:
        """Call a service and return its response."""
        if service not in self._clients:  # one that is made anew may not hear its answer yet
            self._clients[service] = self.node.create_client(kind, service)
        client = self._clients[service]
        self.wait(client.service_is_ready, ANSWER, service)
        future = client.call_async(request)
        self.wait(future.done, ANSWER, f"the answer of {service}")
        return future.result()

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        self.node.destroy_node()

    def latest(self, topic: str) -> Any:
        """Return the newest message of a topic, or None."""
        return self.heard[topic][-1] if self.heard[topic] else None


@contextmanager
def _own_domain() -> Iterator[int]:
    """Give the number of a domain that nobody else uses; tells what goes wrong meanwhile.

    ``domain_id`` itself takes an OSError for a domain that is taken: "generator didn't stop after throw()".
    """
    failure: OSError | None = None
    with domain_id() as domain:
        try:
            yield domain
        except OSError as error:
            failure = error
    if failure is not None:
        raise failure


@contextmanager
def running(
    processes: tuple[Process, ...],
    topics: tuple[str, ...],
    folder: Path,
    extra: Mapping[str, str] | None = None,
    command: Callable[[Process], list[str]] | None = None,
) -> Iterator[tuple[Supervisor, Ear]]:
    """Run processes in a ROS domain of their own; gives the supervisor and an ear in the same domain.

    Args:
        processes: What to run.
        topics: What the ear hears, relative or absolute.
        folder: Gets the logs.
        extra: More of the environment, of the processes and of the ear.
        command: See ``Supervisor``.

    Raises:
        SecurityError: Security is asked for: for such a domain there are no keys.
    """
    check_unsecured({**os.environ, **(extra or {})})
    with _own_domain() as domain:
        here = {"ROS_DOMAIN_ID": str(domain), RANGE: HERE, **(extra or {})}
        own = {**defaults({**os.environ, **here}), **here}
        before = {key: os.environ.get(key) for key in own}
        os.environ.update(own)
        rclpy.init()
        try:
            ear = Ear(topics)
            try:
                with Supervisor(processes, folder / "log", dict(os.environ), command) as supervisor:
                    yield supervisor, ear
            finally:
                ear.close()  # while its context lives: two of one domain in one process may block each other
        finally:
            rclpy.try_shutdown()
            for key, value in before.items():
                os.environ.pop(key) if value is None else os.environ.__setitem__(key, value)
