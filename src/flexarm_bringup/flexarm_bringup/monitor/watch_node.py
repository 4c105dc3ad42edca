"""The monitor as a process: frames until Ctrl-C, or a single one."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from flexarm_bringup.monitor.drawing import draw, paint
from flexarm_bringup.monitor.monitor_node import MonitorNode
from flexarm_bringup.monitor.picture import Picture
from flexarm_bringup.monitor.screen import Screen
from flexarm_bringup.processes.asked_to_end import holding_signals_back
from flexarm_model.ros.tool_node import in_domain

SETTLE = 1.5  # s; after the first word, until all have spoken, and then until rates are known


def watch(manipulator: str, rate: float, seconds: float) -> None:
    """Draw ``rate`` frames a second for so long [s], or until Ctrl-C."""
    end = time.monotonic() + seconds
    with _listener(manipulator) as node, Screen(sys.stdout) as screen:
        try:
            while time.monotonic() < end:
                node.listen(1.0 / rate)
                with holding_signals_back():  # out of rclpy a KeyboardInterrupt comes as something else
                    picture = node.picture()
                screen.show(paint(draw(picture), screen.size[0], screen.has_colour))
        except KeyboardInterrupt:
            return


def print_once(manipulator: str, patience: float) -> bool:
    """Print one frame soon after the first word, which may take ``patience`` [s].

    Returns:
        Whether anything was heard.
    """
    with _listener(manipulator) as node:
        _listen_until(node, lambda: not _is_empty(node.picture()), patience)
        if _is_empty(node.picture()):
            domain = node.picture().domain
            print(
                f"flexarm monitor: heard nothing for {patience:g} s in domain {domain}; "
                "same ROS_DOMAIN_ID and discovery range as the rig?",
                file=sys.stderr,
            )
            return False
        _listen_until(node, lambda: node.picture().is_complete, SETTLE)
        node.listen(SETTLE)
        screen = Screen(sys.stdout)
        print("\n".join(paint(draw(node.picture()), screen.size[0], screen.has_colour)))
        return True


def _listen_until(node: MonitorNode, holds: Callable[[], bool], seconds: float) -> None:
    deadline = time.monotonic() + seconds
    while not holds() and time.monotonic() < deadline:
        node.listen(0.1)


def _is_empty(picture: Picture) -> bool:
    return not picture.topics and not picture.verdicts


@contextmanager
def _listener(manipulator: str) -> Iterator[MonitorNode]:
    with in_domain():
        node = MonitorNode(manipulator)
        try:
            yield node
        finally:
            node.close()
