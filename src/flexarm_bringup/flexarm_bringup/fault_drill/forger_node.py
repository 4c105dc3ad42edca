"""Sends commands that nobody of the rig has sent: forged ones, and real ones once more.

    python -m flexarm_bringup.fault_drill.forger_node COUNT EFFORT...

sends some with guessed tokens, from where it runs, and prints who listens.
"""

from __future__ import annotations

import math
import random
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import rclpy
from flexarm_interfaces.msg import JointCommand
from rclpy.node import Node

from flexarm_bringup.fault_drill.forged import Kind, guess
from flexarm_bringup.fault_drill.system_stand import PATIENCE, SystemStand, stamp
from flexarm_bringup.processes.running_graph_node import Ear
from flexarm_bringup.topics import NAMESPACE
from flexarm_model.ros.node import RELIABLE_QOS

PACE = 0.002  # s between two commands
SEARCH = 3.0  # s for listeners to be found
KEPT = 40  # real commands that may be sent again
FRESH = 2.0  # periods
SETTLE = 0.3  # s in which the guard has told what it did


@dataclass(frozen=True)
class Outcome:
    """What became of forged commands.

    Attributes:
        sent: How many there were.
        applied: How many the guard let through.
        refused: How many it counted as refused, real ones that came meanwhile included.
        alarm: Time until it told of the first [s].
    """

    sent: int
    applied: int
    refused: int
    alarm: float


class Forger:
    """Sends forged commands to a machine and counts what the guard does with them.

    Attributes:
        stops: How often the arm was found stopped; it was armed again then.
    """

    def __init__(self, stand: SystemStand, ear: Ear) -> None:
        """Speak, and listen, through an ear that hears ``forgery_rows.TOPICS``."""
        self.stops = 0
        self._stand, self._ear, self._random = stand, ear, random.Random(stand.stand.seed)
        self._limit = [axis.effort for axis in stand.stand.arm.config.actuated.values()]
        self._period_ns = round(1e9 * stand.dt)
        self._asked: set[tuple[float, ...]] = set()  # torques that were made up: nobody else asks for them
        self._real: list[Any] = []  # commands of the session, the newest last
        self._looked = 0
        self._publisher = command_publisher(ear)

    def attack(self, kind: Kind) -> Outcome:
        """Send all commands of a kind, each right after a real one, whose successor it claims to be."""
        return self._count(kind.count, lambda n: self._forge(kind))

    def repeat(self, old: Sequence[Any], pace: float = PACE) -> Outcome:
        """Send commands as they are."""

        def send(n: int) -> None:
            """Send one."""
            self._asked.add(tuple(old[n].effort))
            self._publisher.publish(old[n])
            self._ear.listen(pace)

        return self._count(len(old), send)

    def _count(self, count: int, send: Callable[[int], None]) -> Outcome:
        ear = self._ear
        ear.listen(SETTLE)
        before, first = ear.latest("guard_status").refused, len(ear.heard["applied_effort"])
        started, alarm = time.monotonic(), math.inf
        for n in range(count):
            send(n)
            if ear.latest("guard_status").refused > before:
                alarm = min(alarm, time.monotonic() - started)
        ear.listen(SETTLE)
        acted = {tuple(msg.effort) for msg in ear.heard["applied_effort"][first:]}  # a bridged one acts twice
        return Outcome(count, len(acted & self._asked), ear.latest("guard_status").refused - before, alarm)

    def _forge(self, kind: Kind) -> None:
        self._wait_for_real(kind.every)
        msg = kind.make(self._real, self._period_ns, self._limit, self._random)
        if kind.is_made_up:
            self._asked.add(tuple(msg.effort))
        self._publisher.publish(msg)

    def _wait_for_real(self, number: int) -> None:
        """Wait until the controller has sent so many commands more; arm again where it has stopped."""
        while not self._hears(self._look() + number):
            self.stops += 1
            self._stand.arm(self._ear)

    def _hears(self, sequence: int) -> bool:
        """Wait until a new command of at least this number is heard; tell whether the arm is armed then."""

        def is_time() -> bool:
            """Tell whether to go on."""
            return (self._look() >= sequence and self._is_up_to_date) or self._is_stopped

        self._ear.wait(is_time, PATIENCE, "commands of the controller")
        return not self._is_stopped

    @property
    def _is_up_to_date(self) -> bool:
        """Whether the newest command is of now: on a busy machine the ear hears some of them late."""
        return 1e9 * (time.time() - stamp(self._real[-1])) < FRESH * self._period_ns

    @property
    def _is_stopped(self) -> bool:
        status = self._ear.latest("guard_status")
        return bool(status.mode != status.ARMED)

    def _look(self) -> int:
        """Take note of what the controller has sent in this session; return its newest number."""
        token, heard = self._ear.latest("guard_status").session_token, self._ear.heard["joint_commands"]
        kept = [msg for msg in self._real if msg.session_token == token]
        new, self._looked = heard[self._looked :], len(heard)
        for msg in new:
            is_real = msg.session_token == token and tuple(msg.effort) not in self._asked
            if is_real and msg.sequence > (kept[-1].sequence if kept else 0):  # else it has been repeated
                kept.append(msg)
        self._real = kept[-KEPT:]
        return int(kept[-1].sequence) if kept else 0


def command_publisher(ear: Ear) -> Any:
    """Return what sends commands beside the controller, when the guard hears it; ``ear`` hears them, too."""
    publisher = ear.node.create_publisher(JointCommand, "joint_commands", RELIABLE_QOS)
    ear.wait(lambda: publisher.get_subscription_count() > 1, PATIENCE, "the guard to be found")
    return publisher


def main(arguments: Sequence[str]) -> int:
    """Send forged commands from here."""
    count, like = int(arguments[0]), JointCommand(effort=[float(value) for value in arguments[1:]])
    rclpy.init()
    node, randomness = Node("forger", namespace=NAMESPACE), random.Random(1)
    publisher = node.create_publisher(JointCommand, "joint_commands", RELIABLE_QOS)
    end = time.monotonic() + SEARCH
    while not publisher.get_subscription_count() and time.monotonic() < end:
        time.sleep(PACE)
    for _ in range(count):
        like.header.stamp = node.get_clock().now().to_msg()
        guess(like, 0, randomness)
        publisher.publish(like)
        time.sleep(PACE)
    print(f"{publisher.get_subscription_count()} listener(s)")
    rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
