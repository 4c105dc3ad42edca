"""The drives' end of the rig node: whom they obey, and what they do when nobody speaks.

Publishes
    ~/attached (std_msgs/String, latched): fingerprint of the guard that the drives obey; empty for none.
Services
    ~/attach (std_srvs/Trigger): gives a guard the secret of its seal; one guard at a time, another one only
        after the drives have let go, with the arm at rest.

A driver of a real rig does the same with ``flexarm_controller.drives``: ``Attachment`` and ``DriveWatchdog``.
"""

from __future__ import annotations

import secrets
from collections.abc import Sequence

from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger

from flexarm_controller.drives.attachment import Attachment
from flexarm_controller.drives.conversions import sealed_from_msg
from flexarm_controller.drives.seal import SECRET_BYTES, Mark
from flexarm_controller.drives.watchdog import DriveLimits, DriveWatchdog
from flexarm_model.ros.node import LATCHED_QOS


class DriveSide:
    """Connects ``Attachment`` and ``DriveWatchdog`` to topics.

    Attributes:
        is_running: In lockstep, that time has begun: from then on nobody else may attach.
    """

    def __init__(self, node: Node, limits: DriveLimits, is_lockstep: bool) -> None:
        """Obey nobody.

        Args:
            node: The rig node.
            limits: Of the drives.
            is_lockstep: Silence means nothing.
        """
        self._node, self._limits, self._is_lockstep = node, limits, is_lockstep
        self._attachment, self._watchdog = Attachment(), DriveWatchdog(limits)
        self._effort: Sequence[float] | None = None  # since the last choice
        self._before, self.is_running = "", False
        self._publisher = node.create_publisher(String, "~/attached", LATCHED_QOS)
        self._publisher.publish(String())
        node.create_service(Trigger, "~/attach", self.on_attach)

    @property
    def stands(self) -> bool:
        """Whether the drives have let go, and the arm is at rest under closed brakes."""
        watchdog = self._watchdog
        return watchdog.has_let_go and watchdog.are_brakes_closed and not watchdog.unready()

    @property
    def are_brakes_closed(self) -> bool:
        """What the holding brakes are to be from now on."""
        return self._watchdog.are_brakes_closed

    def on_attach(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Give a guard its secret, or the reason why not."""
        is_taken = self.is_running if self._is_lockstep else not self._watchdog.has_let_go
        response.success = False
        if is_taken:
            response.message = f"the drives obey guard {self._attachment.fingerprint}"
        elif moves := self._watchdog.unready(not self._is_lockstep):
            response.message = f"the arm still moves: {moves}"
        else:
            secret = secrets.token_hex(SECRET_BYTES)
            self._attachment.attach(secret)
            self._watchdog.attach()
            response.success, response.message = True, f"{secret} {self._before}".rstrip()
            self._tell(f"the drives obey guard {self._attachment.fingerprint}")
        return response

    def take(self, msg: JointState, oldest_ns: int) -> Mark | None:
        """Keep torques for the period that comes; None if they are not the attached guard's, or too old.

        Args:
            msg: Torques.
            oldest_ns: Stamp [ns] before which they mean nothing any more.
        """
        sealed = sealed_from_msg(msg)
        mark = self._attachment.open(sealed, oldest_ns)
        if mark is None:
            text = f"{self._attachment.refused} torques refused that are not of the attached guard, or old"
            self._node.get_logger().warning(text, throttle_duration_sec=5.0)
        else:
            self._effort = sealed.effort
            if mark.is_driving:
                self._watchdog.open_brakes(sealed.effort)
        return mark

    def choose(self, velocity: Sequence[float]) -> list[float]:
        """Return the torque of the period that starts now [N m] or [N]; ``velocity`` of the axes, SI."""
        effort, self._effort = self._effort, None
        had_let_go = self._watchdog.has_let_go
        tau = self._watchdog.step(effort, velocity)
        if self._watchdog.has_let_go and not had_let_go:
            self._before = f"drives let go, guard silent for {1e3 * self._limits.silence:.0f} ms"
            self._attachment.release()
            self._tell(self._before)
        return tau

    def _tell(self, text: str) -> None:
        self._node.get_logger().info(text)
        self._publisher.publish(String(data=self._attachment.fingerprint))
