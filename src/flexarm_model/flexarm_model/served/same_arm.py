"""Is a served model of the arm that a node has loaded? Every node that takes models asks it the same."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from flexarm_model.manipulator.description import ManipulatorConfig


class Served(Protocol):
    """What a model says of its arm, be it a ``ReducedModel`` or its message."""

    @property
    def manipulator(self) -> str:
        """Name of the arm."""

    @property
    def config_id(self) -> str:
        """Hash of the description it was made of."""

    @property
    def theta_names(self) -> Sequence[str]:
        """Actuated axes, "joint.axis"."""


def foreign_model(model: Served, config: ManipulatorConfig, who: str) -> str:
    """Return why a model is refused as one of another arm; empty when it is of this one.

    Args:
        model: The model, or its message.
        config: What was loaded.
        who: Loaded it: "the guard".
    """
    if model.config_id != config.config_id:
        return (
            f"model refused: model of '{model.manipulator}' has config {model.config_id}, {who} loaded "
            f"{config.config_id} (preset '{config.preset}'): start both with the same file and preset"
        )
    if tuple(model.theta_names) != tuple(config.actuated):
        axes = ", ".join(config.actuated)
        return f"model refused: its axes are {', '.join(model.theta_names)}, those of {who} {axes}"
    return ""
