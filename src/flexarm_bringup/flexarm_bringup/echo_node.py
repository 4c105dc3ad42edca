"""Print the messages of a topic, where there is no ros2 command.

  flexarm echo modal_state                 every message as YAML; Ctrl-C ends
  flexarm echo controller_status --once    the next one (a latched one at once)
  flexarm echo modal_state --field eta     one field only; nested: header.stamp.sec, sensors[0].name
  flexarm echo modal_state --hz            rate and jitter instead, once a second
  flexarm echo                             list what is published now, with types and publishers

Topics are relative to /flexarm unless they begin with a slash. A field that is text is printed as it is.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Sequence
from typing import Any

import numpy as np
from rclpy.node import Node

from flexarm_bringup.arguments import number
from flexarm_bringup.exit_codes import UNUSABLE
from flexarm_bringup.message_class import message_class
from flexarm_bringup.message_fields import pick, written
from flexarm_bringup.processes.spinning import spin_once
from flexarm_bringup.processes.surroundings import check_domain
from flexarm_bringup.published_node import await_types, find_offered, find_published
from flexarm_bringup.topics import NAMESPACE
from flexarm_model.process.leaving import LEAVING, ends_within
from flexarm_model.ros.node import events_executor
from flexarm_model.ros.tool_node import in_domain
from flexarm_model.settings.strict_yaml import ConfigError

DISCOVERY = 3.0  # s; how long a topic may take to be seen
SILENCE = 3.0  # s after which it is said that nothing has come
WINDOW = 1.0  # s; over which a rate is told


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("topic", nargs="?", help="relative to /flexarm, or absolute; none: list all")
    parser.add_argument("--once", action="store_true", help="end after the first message")
    parser.add_argument("--field", default="", help="only this: header.stamp.sec, sensors[0].name")
    parser.add_argument("--hz", action="store_true", help="rate and jitter instead of messages")
    parser.add_argument(
        "--wait", type=number(at_least=0.0), default=DISCOVERY, metavar="S", help="for the topic; 3 s"
    )


def run(args: argparse.Namespace) -> int:
    """Print until the first message (``--once``) or Ctrl-C; exit code 2 without such a topic or domain."""
    try:
        _check_options(args)
        check_domain()
    except ConfigError as error:
        print(f"flexarm echo: {error}", file=sys.stderr)
        return UNUSABLE
    with in_domain():
        node, code = Node("echo", namespace="flexarm", start_parameter_services=False), UNUSABLE
        try:
            code = _list(node, args.wait) if args.topic is None else _Echo(node, args).run()
        finally:
            with ends_within(LEAVING, code):
                node.destroy_node()
    return code


def _check_options(args: argparse.Namespace) -> None:
    if args.topic is None and (args.once or args.field or args.hz):
        raise ConfigError("--once, --field and --hz need a topic")
    if args.once and args.hz:
        raise ConfigError(f"--hz takes {WINDOW:g} s of messages, --once ends after the first")
    if args.field and args.hz:
        raise ConfigError("--hz counts whole messages, --field prints a part of each: one of them")


class _Echo:
    """Subscribes with the quality that the publishers offer."""

    def __init__(self, node: Node, args: argparse.Namespace) -> None:
        self._node, self._args = node, args
        topic = str(args.topic)
        self._topic = topic if topic.startswith("/") else f"{NAMESPACE}/{topic}"
        self._times: list[float] = []
        self._heard, self._failure = 0, ""
        self._cut_off: BrokenPipeError | None = None  # raised in a callback, the executor prints it as fatal

    def run(self) -> int:
        """Listen and print; return the exit code."""
        kinds = await_types(self._node, self._topic, self._args.wait)
        try:
            kind, message = self._chosen(kinds)
        except ConfigError as error:
            print(f"flexarm echo: {error}", file=sys.stderr)
            return UNUSABLE
        quality = find_offered(self._node, self._topic, kind)
        self._node.create_subscription(message, self._topic, self._on_message, quality)
        executor = events_executor()
        executor.add_node(self._node)
        patient_until = time.monotonic() + SILENCE
        while not (self._failure or self._cut_off or (self._args.once and self._heard)):
            spin_once(executor, 0.1)
            if not self._heard and time.monotonic() > patient_until:
                patient_until = math.inf
                said = f"nothing came within {SILENCE:g} s; it may be said only when something happens"
                print(f"flexarm echo: {self._topic}: {said}. Ctrl-C ends", file=sys.stderr)
        executor.shutdown()
        if self._cut_off:
            raise self._cut_off
        if self._failure:
            print(f"flexarm echo: {self._failure}", file=sys.stderr)
        return UNUSABLE if self._failure else 0

    def _chosen(self, kinds: Sequence[str]) -> tuple[str, Any]:
        """Return the first type of those that are published, and its class; say which are left out.

        Raises:
            ConfigError: There is none, or it is not installed.
        """
        if not kinds:
            names = ", ".join(sorted(find_published(self._node))) or "nothing"
            raise ConfigError(
                f"{self._topic}: nobody publishes it; published now: {names}. "
                "Same ROS_DOMAIN_ID and discovery range?"
            )
        kind, *others = kinds
        if others:
            said = f"also published as {', '.join(others)}; these are {kind}. `flexarm echo` says by whom"
            print(f"flexarm echo: {self._topic}: {said}", file=sys.stderr)
        return kind, installed_class(self._topic, kind)

    def _on_message(self, msg: Any) -> None:
        if self._cut_off or (self._args.once and self._heard):
            return
        self._heard += 1
        if self._args.hz:
            self._measure()
            return
        try:
            value = pick(msg, self._args.field)
        except AttributeError as error:
            self._failure = str(error)
            return
        self._print(written(value) + ("---\n" if not self._args.field else ""))

    def _measure(self) -> None:
        self._times.append(time.monotonic())
        if self._times[-1] - self._times[0] < WINDOW:
            return
        steps = np.diff(self._times)
        self._print(
            f"{1 / steps.mean():8.2f} Hz   longest gap {1e3 * steps.max():7.2f} ms   "
            f"jitter {1e3 * steps.std():6.2f} ms   {steps.size} messages\n"
        )
        self._times = self._times[-1:]

    def _print(self, text: str) -> None:
        try:
            print(text, end="", flush=True)
        except BrokenPipeError as error:
            self._cut_off = error


def installed_class(topic: str, kind: str) -> Any:
    """Return the class of the messages of a topic.

    Raises:
        ConfigError: It is not installed here, be it the whole package or this message.
    """
    try:
        return message_class(kind)
    except ImportError:
        told = "whose package is not installed here (source its workspace)"
    except (AttributeError, ValueError):  # a package of another version, or a type that is not of ROS
        told = "which is no message of a package that is installed here (source the workspace that has it)"
    raise ConfigError(f"{topic} has type {kind}, {told}")


def _list(node: Node, wait: float) -> int:
    end = time.monotonic() + wait
    while time.monotonic() < end:
        time.sleep(0.1)
    for name, kinds in sorted(find_published(node).items()):
        for kind, nodes in kinds.items():
            print(f"{name:42} {kind:42} {', '.join(nodes)}")
    return 0
