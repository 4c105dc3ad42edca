"""Moves the arm to and fro for a while by the clock, and watches guard and controller keep time.

Publishes
    reference (trajectory_msgs/JointTrajectory): once.
Subscribes
    guard_status, controller_status, ~/ready of the nodes.
Calls
    guard/arm (std_srvs/Trigger).
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

import rclpy
from flexarm_interfaces.msg import ControllerStatus, GuardStatus
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import Bool
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory

from flexarm_bringup.processes.late_cycles import LateCycles
from flexarm_bringup.processes.spinning import MANY, spin_once
from flexarm_bringup.realtime.answered import AnsweredPeriods
from flexarm_bringup.realtime.figures import Counts, Figures
from flexarm_controller.conversions import reference_to_msg
from flexarm_controller.reference import Reference
from flexarm_model.conversions import NS_PER_S, stamp_to_ns
from flexarm_model.ros.node import LATCHED_QOS, LOCKSTEP_QOS, RELIABLE_QOS, events_executor

PARTNERS = ("model", "estimator", "controller", "guard", "rig")
PATIENCE = 60.0  # s until everything is ready, and for every answer
PREPARATION = 4.0  # s between sending the reference and its start
TRIES = 3
Wait = Callable[[str, Callable[[], bool]], None]
NAMES = ("INACTIVE", "MPC", "LQR", "SHIFTED_PLAN", "DAMPING", "HOLD", "PD", "NONLINEAR")
MODES = {getattr(ControllerStatus, name): name.lower() for name in NAMES}


class DriverError(RuntimeError):
    """The run did not begin; the message says what it waited for."""


class Driver(Node):
    """Sends the reference, arms, watches."""

    def __init__(self, names: tuple[str, ...], period: float) -> None:
        """Connect; ``names`` are those of the actuated axes, ``period`` of the controller [s]."""
        super().__init__("realtime_driver", namespace="flexarm")
        self._names, self._ready = names, dict.fromkeys(PARTNERS, False)
        self._guard, self._status = GuardStatus(), ControllerStatus()
        self._answer, self._answered = "", AnsweredPeriods(period)
        self._modes: Counter[str] = Counter()
        self._steps: list[float] = []
        self._late = LateCycles()
        self._executor = events_executor()
        self._executor.add_node(self)
        self._publisher = self.create_publisher(JointTrajectory, "reference", RELIABLE_QOS)
        self._client = self.create_client(Trigger, "guard/arm")
        self.create_subscription(GuardStatus, "guard_status", self.on_guard, RELIABLE_QOS)
        self.create_subscription(ControllerStatus, "controller_status", self.on_status, LOCKSTEP_QOS)
        for name in PARTNERS:
            self.create_subscription(
                Bool,
                f"{name}/ready",
                lambda msg, name=name: self._ready.update({name: msg.data}),
                LATCHED_QOS,
            )

    def on_guard(self, msg: GuardStatus) -> None:
        """Keep the newest status of the guard."""
        self._guard = msg
        self._late.note(time.monotonic(), msg.late_ticks, msg.ticks)

    def on_status(self, msg: ControllerStatus) -> None:
        """Count an answer of the controller, or keep what it says of the reference."""
        if msg.reason.startswith("reference"):
            self._answer = msg.reason
            return
        self._status = msg
        self._answered.note(stamp_to_ns(msg.header.stamp), msg.missed_cycles)
        self._modes[MODES.get(msg.mode, str(msg.mode))] += 1
        self._steps.append(msg.solve_time)

    def run(self, reference: Reference, seconds: float, failed: Callable[[], str]) -> Figures:
        """Follow the reference for a while and return the counts.

        Args:
            reference: Begins at time zero.
            seconds: How long to watch [s].
            failed: Says which process has ended; empty when all run.

        Raises:
            DriverError: It did not begin.
        """
        self._begin(reference, failed)
        self._modes.clear()
        self._steps.clear()
        self._late.begin()
        start, began = self._counts(), time.monotonic()
        while time.monotonic() - began < seconds and self._guard.mode == GuardStatus.ARMED and not failed():
            spin_once(self._executor, 0.05, MANY)
        stop = failed() or ("" if self._guard.mode == GuardStatus.ARMED else self._guard.reason)
        counts = self._counts().since(start)
        return Figures(
            began, time.monotonic() - began, counts, dict(self._modes), tuple(self._steps), self._late, stop
        )

    def _begin(self, reference: Reference, failed: Callable[[], str]) -> None:
        """Wait until all are ready, and set out; a machine that stood still meanwhile has another try."""
        wait = partial(self._wait, failed)
        wait("the nodes to be ready", lambda: all(self._ready.values()))
        wait("the guard", lambda: self._guard.ticks > 0 and self._publisher.get_subscription_count() > 1)
        wait("guard/arm", self._client.service_is_ready)
        for _ in range(TRIES):
            self._set_out(reference, wait)
            if self._guard.mode == GuardStatus.ARMED:
                return
        why = f"the guard stopped the arm {TRIES} times before the start: {self._guard.reason}"
        raise DriverError(f"{why}; does something else use this machine?")

    def _set_out(self, reference: Reference, wait: Wait) -> None:
        """Send the reference, arm, and wait until the reference begins."""
        self._answer = ""
        zero_ns = stamp_to_ns(self._guard.header.stamp) + round(PREPARATION * NS_PER_S)
        self._publisher.publish(reference_to_msg(reference, self._names, zero_ns))
        wait("the reference to be accepted", lambda: self._answer.startswith("reference accepted"))
        self._client.call_async(Trigger.Request())
        wait("the guard to be armed", lambda: self._guard.mode == GuardStatus.ARMED)
        wait("the start", lambda: stamp_to_ns(self._guard.header.stamp) >= zero_ns)

    def _wait(self, failed: Callable[[], str], what: str, holds: Callable[[], bool]) -> None:
        """Listen until a condition holds."""
        deadline = time.monotonic() + PATIENCE
        while not holds():
            if failed() or time.monotonic() > deadline:
                waited = f"waited {PATIENCE:g} s for {what}: {self._answer or 'nothing'}"
                raise DriverError(failed() or waited)
            spin_once(self._executor, 0.05, MANY)

    def _counts(self) -> Counts:
        g, s = self._guard, self._status
        return Counts(g.ticks, g.ticks_without_command, self._answered.total, s.overruns, s.missed_cycles)

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        self.destroy_node()


def drive(
    names: Iterable[str], period: float, reference: Reference, seconds: float, failed: Callable[[], str]
) -> Figures:
    """Run in this process; see ``Driver`` and ``Driver.run``.

    Raises:
        DriverError: It did not begin.
    """
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)  # Ctrl-C raises here
    driver: Any = Driver(tuple(names), period)
    try:
        return driver.run(reference, seconds, failed)
    finally:
        driver.close()
        rclpy.try_shutdown()
