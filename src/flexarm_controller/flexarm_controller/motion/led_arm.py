"""The controller as what follows references: it is given them as messages, as anybody else gives them."""

from __future__ import annotations

import math

from flexarm_controller.answer import Outgoing
from flexarm_controller.exchange import REFUSED, ControllerExchange
from flexarm_controller.motion.conversions import own_reference_msg
from flexarm_controller.reference import Reference
from flexarm_controller.state import ArmState
from flexarm_model.served.reduced_model import ReducedModel


class LedArm:
    """Follows references.

    Attributes:
        state: The newest one.
        epoch_ns: Stamp that is time zero [ns].
        sent: Messages of the references it has taken, and what was said of them.
    """

    def __init__(
        self, exchange: ControllerExchange, state: ArmState, names: tuple[str, ...], epoch_ns: int
    ) -> None:
        """Take the exchange of the controller, the state, names of the axes and the epoch."""
        assert exchange.controller is not None
        self._exchange, self._controller, self._names = exchange, exchange.controller, names
        self.state, self.epoch_ns = state, epoch_ns
        self.sent: list[Outgoing] = []

    @property
    def now_ns(self) -> int:
        """Stamp of the state [ns]."""
        return self.epoch_ns + round(1e9 * self.state.t)

    @property
    def model(self) -> ReducedModel:
        """The served model in use."""
        return self._controller.model

    @property
    def reference(self) -> Reference | None:
        """What is followed."""
        return self._controller.reference

    def follows(self, reference: Reference | None) -> bool:
        """Tell whether this very reference is followed now, or waits for its begin."""
        return self._controller.queue.follows(reference, self.state.t)

    @property
    def ended_by(self) -> str:
        """Why nothing is followed any more: the guard has stopped the arm, or its state was lost."""
        exchange = self._exchange
        if exchange.is_armed and exchange.answer is not None and exchange.answer.reason:
            return exchange.answer.reason
        return ": ".join(filter(None, ("the arm was stopped", exchange.guard.stopped_by)))

    def forget(self) -> bool:
        """Follow nothing; returns whether a reference was waiting."""
        return self._controller.drop_reference(math.inf) is not None

    def follow(self, reference: Reference) -> str:
        """Hand a reference to the controller as it is sent; returns why it is refused."""
        msg = own_reference_msg(reference, self._names, self.epoch_ns)
        (answer,) = self._exchange.on_reference(msg)
        if answer.msg.reason.startswith(REFUSED):
            return str(answer.msg.reason).removeprefix(REFUSED)
        self.sent += [Outgoing("reference", msg), answer]
        return ""
