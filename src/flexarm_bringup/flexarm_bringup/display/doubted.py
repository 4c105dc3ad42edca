"""Why an estimate is not drawn: a picture is of a state that can be trusted, by its own model."""

from __future__ import annotations

from typing import Any

import numpy as np

from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.served.same_arm import foreign_model

LARGEST = 1e6  # rad, m or kg^0.5 m; beyond it numbers have gone wrong, and what is drawn might overflow


def not_drawn(state: Any, model: ReducedModel, config: ManipulatorConfig) -> str:
    """Return why a state is not drawn; empty where it can be.

    The words name no number that changes from one state to the next: they are told when they change.

    Args:
        state: ModalState that was heard.
        model: That of its hash; the newest where that was never heard.
        config: Description of the arm that is drawn.
    """
    fault = foreign_model(model, config, "the markers node")
    if fault:
        return fault
    if model.model_id != state.model_id:
        return "the model that the estimate quotes was not heard"
    if state.status == state.LOST:
        return "the estimate is lost; modal_state says why"
    is_sound = np.all(np.abs([*state.theta, *state.eta]) < LARGEST)  # False for what is no number
    return "" if is_sound else f"the estimate is no number, or beyond {LARGEST:.0e}"
