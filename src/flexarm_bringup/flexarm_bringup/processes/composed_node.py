"""Estimator and controller in one process: the estimate goes from one to the other without DDS.

Both are the nodes they are alone, with their names, topics, services and parameters, in one executor. A
state is handed to the controller as the object it is, and answered at once; only then is it published as
``modal_state``, if somebody listens. What is spared is to write and read a message, its way through DDS and
the wait for another process.

Parameters of one of the two stand under its name in a file (``--params-file``: ``/flexarm/controller:``);
a file may hold those of one alone. Those given with ``-p`` go to both (``manipulator``, ``preset``,
``realtime_priority``).

Publishes, subscribes, services: those of ``estimator_node`` and ``controller_node``.
"""

from __future__ import annotations

from flexarm_bringup.processes.handed_state import HandedState
from flexarm_controller.controller_node import ControllerNode
from flexarm_estimator.estimator_node import EstimatorNode
from flexarm_model.ros.node import run_node

HANDED_OVER = "modal_state"


class EstimatorBeside(EstimatorNode):
    """The estimator that hands its states over before it publishes them."""

    BESIDE = ("controller",)

    def __init__(self, controller: ComposedController) -> None:
        """Work for ``controller``."""
        self._controller = controller
        super().__init__()

    def _tell(self) -> None:
        estimate = self.exchange.estimate
        assert estimate is not None
        self._controller.take(HandedState(estimate, self.exchange.told_ns))
        super()._tell()


class ComposedController(ControllerNode):
    """The controller, with the estimator beside it.

    Attributes:
        companions: Nodes that share the executor.
    """

    BESIDE = ("estimator",)

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

    def take(self, told: HandedState) -> None:
        """Answer a state that was not sent but handed over, unless the controller is not active."""
        if self.is_active:
            self.on_state(told)


def main() -> int:
    """Run both nodes."""
    return run_node(ComposedController)
