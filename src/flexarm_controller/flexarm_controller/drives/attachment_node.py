"""The guard's end of its attachment to the drives.

Calls
    rig/attach (std_srvs/Trigger): the answer is the secret of the seal, and why the last guard was let go; a
        refusal names the guard that is obeyed.
Subscribes
    rig/attached (std_msgs/String, latched): fingerprint of the guard that the drives obey; empty for none.

A service instead of the identity that DDS gives a publisher: rclpy does not tell a subscriber who sent a
message, and the drives of another maker can keep a secret, but need not know DDS.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from std_msgs.msg import String
from std_srvs.srv import Trigger

from flexarm_controller.drives.seal import Seal
from flexarm_model.ros.node import LATCHED_QOS

RETRY_PERIOD = 0.1  # s
ASK_AGAIN = 20  # of these without an answer: the drives have been started anew
GONE_AFTER = 10  # of these without their service; a run that ends in order is over before
GONE = "the drives are gone: nobody offers rig/attach"
DOUBTED = "drives or guard were away; the drives have not told yet whom they obey"
UNTOLD = "the drives have not told yet how the arm moves"


class AttachedGuard:
    """Asks the drives for a secret until they give one, and again when they have let go, or may have.

    Attributes:
        seal: With which to seal torques; None while the drives do not obey this guard.
        refusal: Why they do not; empty when they do.
        before: Why they let go of the guard before this one; empty where there was none.
    """

    def __init__(self, node: Node, on_release: Callable[[str], None], is_lockstep: bool) -> None:
        """Begin to ask.

        Args:
            node: The guard node.
            on_release: Told why the drives let go of this guard, or of the one before.
            is_lockstep: Nothing else tells that the drives are gone; by the clock their silence does.
        """
        self._node, self._on_release, self._is_lockstep = node, on_release, is_lockstep
        self.seal: Seal | None = None
        self.refusal, self.before = "the drives do not answer", ""
        self._asked: Any = None
        self._is_doubted = False
        self._waited = self._missed = 0
        self._client = node.create_client(Trigger, "rig/attach")
        node.create_subscription(String, "rig/attached", self.on_attached, LATCHED_QOS)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._timer = node.create_timer(RETRY_PERIOD, self.on_timer, clock=steady)

    def unready(self, has_told: bool) -> str:
        """Return why the drives would not do what this guard says; empty when they would.

        Args:
            has_told: They have told how the arm moves.
        """
        is_early = self._is_lockstep and self.before and not has_told
        return self.refusal or (UNTOLD if is_early else "")

    def doubt(self) -> None:
        """Ask anew whom they obey: drives or guard were away, and what came back may know nothing of before.

        The seal is kept until they have answered: where they only stood still they go on to obey it.
        """
        if self.seal is None:
            return
        is_new, self._is_doubted, self.refusal = not self._is_doubted, True, DOUBTED
        self._forget()
        if is_new:  # at once: whoever arms after a short stall need not wait
            self.on_timer()

    def on_timer(self) -> None:
        """Ask if there is somebody to ask; notice when nobody is left who could obey."""
        is_offered = self._client.service_is_ready()
        self._missed = 0 if is_offered else self._missed + 1
        if self._is_lockstep and self.seal is not None and self._missed >= GONE_AFTER:
            self._lose(GONE)
        if self._asked is not None and self._waited < ASK_AGAIN:
            self._waited += 1
        elif is_offered and (self.seal is None or self._is_doubted):
            self._forget()
            self._waited, self._asked = 0, self._client.call_async(Trigger.Request())
            self._asked.add_done_callback(self.on_answer)

    def on_answer(self, future: Any) -> None:
        """Take the secret, or why there is none."""
        if future is not self._asked:
            return
        answer, self._asked = future.result(), None
        if answer.success:
            self._take(*answer.message.partition(" ")[::2])
        elif self.seal is None:
            self.refusal = answer.message
        elif self.seal.fingerprint in answer.message:
            self._is_doubted, self.refusal = False, ""
        else:
            self._lose(answer.message)

    def on_attached(self, msg: String) -> None:
        """Notice that the drives obey nobody, or another guard."""
        if self.seal is not None and msg.data != self.seal.fingerprint:
            self._lose("the drives have let go of this guard")

    def _take(self, secret: str, before: str) -> None:
        self.seal, self.refusal, self.before, self._is_doubted = Seal(secret), "", before, False
        self._node.get_logger().info(f"the drives obey guard {self.seal.fingerprint}")
        if before:
            self._on_release(before)

    def _forget(self) -> None:
        """Wait no longer for an answer to what was asked."""
        if self._asked is not None:
            self._client.remove_pending_request(self._asked)
            self._asked = None

    def _lose(self, reason: str) -> None:
        self.seal, self.refusal, self._is_doubted = None, reason, False
        self._on_release(reason)
