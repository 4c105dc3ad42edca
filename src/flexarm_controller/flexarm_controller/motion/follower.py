"""Who follows references: the controller, or an arm in a test."""

from __future__ import annotations

from typing import Protocol

from flexarm_controller.reference import Reference
from flexarm_model.served.reduced_model import ReducedModel


class Follower(Protocol):
    """Who follows references: the controller."""

    @property
    def model(self) -> ReducedModel:
        """The served model in use."""
        ...

    @property
    def reference(self) -> Reference | None:
        """What is followed; None before anything is."""
        ...

    @property
    def ended_by(self) -> str:
        """Why nothing is followed any more."""
        ...

    def follow(self, reference: Reference) -> str:
        """Take a reference or return why not."""
        ...

    def follows(self, reference: Reference | None) -> bool:
        """Tell whether this very reference is followed now, or waits for its begin."""
        ...
