"""The arming check of the controller node.

Publishes
    ~/margins (std_msgs/String, latched): why nothing may be sent, with the mode by name; empty when it may.
    estimator/settle (std_msgs/Empty): asks for the settled filter of the model in use, where the one that is
        told, or was judged, is of another model.
Subscribes
    estimator/steady_filter (flexarm_interfaces/SteadyFilter, latched).
"""

from __future__ import annotations

import math
import time

from flexarm_interfaces.msg import SteadyFilter
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from std_msgs.msg import Empty, String

from flexarm_controller.exchange import ControllerExchange
from flexarm_controller.laws import LawInputs
from flexarm_controller.margins.arming import ELSEWHERE, HOLD, Arming
from flexarm_controller.margins.gate import Gate
from flexarm_controller.settings import MarginConfig
from flexarm_model.conversions import ModelMessageError, filter_from_msg
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.ros.node import LATCHED_QOS, RELIABLE_QOS

ASK_PERIOD = 1.0  # s
FIRST = 1.0  # s in which a state is answered before anything is judged


class ArmingCheck:
    """Connects an ``Arming`` to topics; what it withholds the exchange does not send."""

    def __init__(
        self,
        node: Node,
        arm: ManipulatorConfig,
        inputs: LawInputs,
        margins: MarginConfig,
        exchange: ControllerExchange,
    ) -> None:
        """Subscribe.

        Args:
            node: The controller node.
            arm: The manipulator.
            inputs: What the law is built from.
            margins: What is wanted.
            exchange: Is told what to withhold.
        """
        gate = Gate(arm, inputs, margins) if margins.margins_required else None
        hold = HOLD if exchange.is_live else math.inf  # in lockstep nothing depends on a clock
        self._node, self._exchange, self._arming = node, exchange, Arming(gate, hold)
        self._n_u = len(arm.actuated)
        self._asked, self._began = -math.inf, time.monotonic()
        self._settle = node.create_publisher(Empty, "estimator/settle", RELIABLE_QOS)
        self._said = node.create_publisher(String, "~/margins", LATCHED_QOS)
        node.create_subscription(SteadyFilter, "estimator/steady_filter", self.on_filter, LATCHED_QOS)
        exchange.withheld = self._arming.reason
        self._first = node.create_timer(
            FIRST, self._look_alone, clock=Clock(clock_type=ClockType.STEADY_TIME)
        )

    @property
    def is_known(self) -> bool:
        """Whether there has been a verdict, or none is wanted."""
        return self._arming.is_known

    def on_filter(self, msg: SteadyFilter) -> None:
        """Take the filter that the estimator has settled on."""
        try:
            self._arming.take(filter_from_msg(msg, self._n_u))
        except ModelMessageError as error:
            self._arming.take(None, str(error))
        self.look()

    def look(self) -> None:
        """Judge what waits; cheap when nothing does.

        By the clock a state is answered first, or a controller that was started again would be silent for as
        long as judging takes.
        """
        exchange, now = self._exchange, time.monotonic()
        if exchange.is_live and exchange.answer is None and now < self._began + FIRST:
            return
        controller, is_armed = exchange.controller, exchange.is_armed
        model = None if controller is None else controller.model
        if self._arming.look(model, is_armed, now):
            self._tell()
        elif self._arming.wants_filter(model, is_armed, now):
            self._ask(now)

    def _look_alone(self) -> None:
        """Look once more where no state has come to be answered."""
        self._first.cancel()
        self.look()

    def _ask(self, now: float) -> None:
        if now - self._asked > ASK_PERIOD:
            self._asked = now
            self._settle.publish(Empty())

    def _tell(self) -> None:
        reason = self._exchange.withheld = self._arming.reason
        self._said.publish(String(data=reason))
        log = self._node.get_logger()
        log.error(reason) if reason not in ("", ELSEWHERE) else log.info(reason or "margins: kept")
