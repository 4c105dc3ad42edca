"""What the guard node says.

Publishes
    applied_effort (sensor_msgs/JointState): torque [N m] or force [N] of every axis from the stamp on, once a
        motor period; ``header.frame_id`` is the seal without which the drives do not obey (``drives.seal``).
    guard_status (flexarm_interfaces/GuardStatus): 10 Hz and on change; in lockstep with an answer.
    /diagnostics (diagnostic_msgs/DiagnosticArray): 1 Hz.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

from flexarm_interfaces.msg import GuardStatus
from rclpy.node import Node
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState

from flexarm_controller.drives.conversions import guard_status_msg
from flexarm_controller.drives.effort_writer import EffortWriter
from flexarm_controller.drives.seal import Mark, Seal
from flexarm_controller.guard import BRAKING, STOPPED
from flexarm_controller.guard_exchange import GuardExchange
from flexarm_controller.guard_health import GuardHealth
from flexarm_controller.guard_session import STATUS_PERIODS
from flexarm_model.ros.diagnostics_node import Diagnostics
from flexarm_model.ros.node import LOCKSTEP_QOS, RELIABLE_QOS
from flexarm_model.settings.diagnosis import DiagnosticsConfig


class GuardVoice:
    """Publishes torques and status; a torque says how many status messages went before it."""

    def __init__(
        self,
        node: Node,
        exchange: GuardExchange,
        is_lockstep: bool,
        late: Callable[[], int],
        thresholds: DiagnosticsConfig,
    ) -> None:
        """Prepare to speak.

        Args:
            node: The guard node.
            exchange: What there is to tell.
            is_lockstep: No message may be lost.
            late: Periods answered late so far [1].
            thresholds: Of the diagnostics.
        """
        told = LOCKSTEP_QOS if is_lockstep else RELIABLE_QOS
        self._node, self._exchange, self._late = node, exchange, late
        self._is_lockstep = is_lockstep
        self._effort = node.create_publisher(JointState, "applied_effort", told)
        self._status = node.create_publisher(GuardStatus, "guard_status", told)
        self._writer = EffortWriter(exchange.names, serialize_message)
        self._said, self._unsaid, self._count = ("", ""), 0, 0
        period = None if is_lockstep else exchange.period_ns * 1e-9
        self._health = GuardHealth(exchange, period, thresholds)
        self._diagnostics = Diagnostics(node, self._health.verdicts)

    def listeners(self) -> tuple[int, int]:
        """Return how many subscribe to torques and to the status [1]."""
        return self._effort.get_subscription_count(), self._status.get_subscription_count()

    def send(self, effort: Sequence[float], seal: Seal | None) -> None:
        """Publish torques, if there is a seal for them, and the status if it is time.

        By the clock drives that are to be left to themselves hear no torque; in lockstep time would stand.
        """
        exchange, is_status_due = self._exchange, self._is_due()
        is_left = exchange.guard.leaves_drives and not self._is_lockstep
        if seal is not None and not is_left:
            mark = Mark(exchange.guard.mode != STOPPED, self._count + is_status_due)
            self._effort.publish(self._writer.write(effort, exchange.answer_ns, seal, mark))
        if is_status_due:
            self.say()
        self._health.note(time.perf_counter(), self._late())

    def say_when_due(self) -> None:
        """Publish the status if it is time; to be called once a period in which nothing is sent."""
        if self._is_due():
            self.say()

    def say_if_time_stands(self, reason: str) -> None:
        """Say in lockstep that the arm is braked by drives that are gone: no tick will come that could."""
        if self._is_lockstep and self._exchange.guard.mode == BRAKING:
            self.say()
            self._node.get_logger().error(f"time stands, start all nodes anew: {reason}")

    def say(self) -> None:
        """Publish the status."""
        guard = self._exchange.guard
        if self._said != (guard.mode, guard.reason):
            self._node.get_logger().info(f"{guard.mode}{': ' if guard.reason else ''}{guard.reason}")
        self._said, self._unsaid = (guard.mode, guard.reason), 0
        self._count += 1
        self._status.publish(guard_status_msg(guard, self._exchange.answer_ns, self._late()))

    def _is_due(self) -> bool:
        self._unsaid += 1
        guard = self._exchange.guard
        return self._unsaid >= STATUS_PERIODS or self._said != (guard.mode, guard.reason)
