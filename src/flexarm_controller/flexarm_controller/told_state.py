"""A state as it is told to the controller: sent by message, or handed over within a process."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from flexarm_controller.conversions import state_from_msg
from flexarm_controller.state import ArmState
from flexarm_model.conversions import LAST_STAMP_NS, stamp_to_ns
from flexarm_model.served.reduced_model import ReducedModel


class ToldState(Protocol):
    """What the controller answers."""

    @property
    def stamp_ns(self) -> int:
        """Instant it belongs to [ns]."""
        ...

    def read(self, model: ReducedModel, epoch_ns: int) -> ArmState:
        """Return the state in the coordinates of ``model``, times from ``epoch_ns`` [ns] on.

        One that does not fit the model comes back as not usable, with the reason.
        """
        ...


@dataclass(frozen=True)
class SentState:
    """A ModalState.

    Attributes:
        msg: The message.
    """

    msg: Any

    @property
    def stamp_ns(self) -> int:
        """Its stamp [ns]; one that cannot be answered is not newer than the last that can."""
        return min(stamp_to_ns(self.msg.header.stamp), LAST_STAMP_NS)

    def read(self, model: ReducedModel, epoch_ns: int) -> ArmState:
        """Return what it says."""
        return state_from_msg(self.msg, model, epoch_ns)
