"""Estimator and controller in one process: the estimate goes from one to the other without DDS.

Both are the nodes they are alone, with their names, topics, services and parameters, in one executor. A
``modal_state`` is handed to the controller as the object it is, and answered at once; only then is it
published, for recorders and people. What is spared is a message through DDS and the wait for another process.

Parameters of one of the two stand under its name in a file (``--params-file``: ``/flexarm/controller:``);
those given with ``-p`` go to both (``manipulator``, ``preset``, ``realtime_priority``).

Publishes, subscribes, services: those of ``estimator_node`` and ``controller_node``.
"""

from __future__ import annotations

from collections.abc import Iterable

from flexarm_interfaces.msg import ModalState

from flexarm_controller.controller_node import ControllerNode
from flexarm_estimator.estimator_node import EstimatorNode
from flexarm_estimator.exchange import Outgoing
from flexarm_model.node import run_node

HANDED_OVER = "modal_state"


class EstimatorBeside(EstimatorNode):
    """The estimator that hands its states over before it publishes them."""

    def __init__(self, controller: ComposedController) -> None:
        """Work for ``controller``."""
        self._controller = controller
        super().__init__()

    def _publish(self, outgoing: Iterable[Outgoing]) -> None:
        told = list(outgoing)
        for out in told:
            if out.topic == HANDED_OVER:
                self._controller.take(out.msg)
        super()._publish(out for out in told if self._is_heard(out.topic))

    def _is_heard(self, topic: str) -> bool:
        return self._outlets[topic].get_subscription_count() > 0


class ComposedController(ControllerNode):
    """The controller, with the estimator beside it.

    Attributes:
        companions: Nodes that share the executor.
    """

    def __init__(self) -> None:
        """Make both nodes."""
        super().__init__()
        self.companions = (EstimatorBeside(self),)

    def activate(self) -> None:
        """Subscribe to all but states: they come from the estimator beside alone."""
        super().activate()
        topic = self.resolve_topic_name(HANDED_OVER)
        for subscription in list(self.subscriptions):
            if subscription.topic_name == topic:
                self.destroy_subscription(subscription)

    def take(self, msg: ModalState) -> None:
        """Answer a state that was not sent but handed over, unless the controller is not active."""
        if self.is_active:
            self.on_modal_state(msg)


def main() -> int:
    """Run both nodes."""
    return run_node(ComposedController)
