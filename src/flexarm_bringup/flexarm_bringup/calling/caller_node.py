"""Caller node: finds services of a running graph and calls them.

Calls
    whatever it is told; the type comes from the graph.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from typing import Any

from rclpy.node import Node

from flexarm_bringup.arguments import number
from flexarm_bringup.calling.request import RequestError
from flexarm_bringup.message_class import message_class
from flexarm_bringup.processes.secured import OPERATOR
from flexarm_bringup.processes.spinning import spin_once
from flexarm_bringup.processes.surroundings import check_domain
from flexarm_bringup.topics import NAMESPACE
from flexarm_model.process.leaving import LEAVING, ends_within
from flexarm_model.ros.node import events_executor
from flexarm_model.ros.tool_node import in_domain
from flexarm_model.settings.strict_yaml import ConfigError

DONE, NOT_DONE, UNUSABLE = 0, 1, 2  # exit codes of who calls
DISCOVERY = 3.0  # s; how long a service may take to be seen
ANSWER = 10.0  # s; the model of a large arm takes some where others use the cores
LOOK_PERIOD = 0.02  # s


class CallError(RuntimeError):
    """Nobody can be called, or nobody answers; the message says what to look at."""


class Caller(Node):  # type: ignore[misc]
    """Calls services."""

    def __init__(self, name: str) -> None:
        """Join the graph under a name in /flexarm."""
        super().__init__(name, namespace="flexarm", start_parameter_services=False)
        self._executor = events_executor()
        self._executor.add_node(self)

    def seen(self) -> dict[str, str]:
        """Return type by absolute name of the services that are seen."""
        return {name: kinds[0] for name, kinds in self.get_service_names_and_types()}

    def listen(self, seconds: float, until: Callable[[], bool] = lambda: False) -> bool:
        """Hear what comes for so long [s], or until something holds; return whether it does."""
        end = time.monotonic() + seconds
        while not (holds := until()) and time.monotonic() < end:
            spin_once(self._executor, LOOK_PERIOD)
        return holds

    def type_of(self, service: str, wait: float) -> str:
        """Return the type of a service that may take ``wait`` [s] to be seen.

        Raises:
            CallError: Nobody offers it; the message lists what is offered.
        """
        if not self.listen(wait, lambda: service in self.seen()):
            names = ", ".join(sorted(offered(self.seen()))) or "nothing"
            raise CallError(
                f"{service}: nobody offers it; offered now: {names}. Same ROS_DOMAIN_ID and discovery range?"
            )
        return self.seen()[service]

    def ask(self, service: str, kind: Any, request: Any, wait: float) -> Any:
        """Call a service once and return its response.

        Args:
            service: Absolute name.
            kind: Class of the service.
            request: Its request.
            wait: How long it may take to be there [s].

        Raises:
            CallError: It is not there, or does not answer; whether it did what was asked is not known then.
        """
        client = self.create_client(kind, service)
        if not self.listen(wait, client.service_is_ready):
            raise CallError(f"{service}: nobody offers it. Same ROS_DOMAIN_ID and discovery range?")
        future = client.call_async(request)
        if not self.listen(ANSWER, future.done):
            raise CallError(f"{service}: no answer within {ANSWER:g} s; it may have heard it all the same")
        return future.result()

    def end(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        self.destroy_node()


def operate(command: str, work: Callable[[Caller], int]) -> int:
    """Let a command work inside the graph that the environment names; signals are left to Python.

    Args:
        command: Its name, which begins what it says.
        work: What it does; returns the exit code. What cannot be called is told, and the code is 2.

    Returns:
        The exit code, with which the process ends by itself if it cannot leave the graph.

    Raises:
        SecurityError: Security is asked for and cannot be had.
    """
    try:
        check_domain()
    except ConfigError as error:
        return tell(command, error)
    with in_domain(OPERATOR):
        caller, code = Caller(command), NOT_DONE
        try:
            code = work(caller)
        except (CallError, ConfigError, RequestError) as error:
            code = tell(command, error)
        finally:
            with ends_within(LEAVING, code):
                caller.end()
    return code


def add_wait(parser: argparse.ArgumentParser) -> None:
    """Declare how long others may take to be seen."""
    parser.add_argument(
        "--wait", type=number(at_least=0.0), default=DISCOVERY, metavar="S", help="for the service; 3 s"
    )


def absolute(name: str) -> str:
    """Return a name relative to /flexarm, or absolute, as an absolute one."""
    return name if name.startswith("/") else f"{NAMESPACE}/{name}"


def offered(services: dict[str, str]) -> dict[str, str]:
    """Return the services that are not those of every node: parameters, life, types."""
    common = ("rcl_interfaces/", "lifecycle_msgs/", "type_description_interfaces/")
    return {name: kind for name, kind in services.items() if not kind.startswith(common)}


def service_class(kind: str) -> Any:
    """Return the class of a service's type.

    Raises:
        CallError: Its package is not installed.
    """
    try:
        return message_class(kind)
    except (ModuleNotFoundError, AttributeError):
        raise CallError(f"{kind}: this type is not installed here") from None


def tell(command: str, error: Exception) -> int:
    """Print why nobody was called and return the exit code."""
    print(f"flexarm {command}: {error}", file=sys.stderr)
    return UNUSABLE
