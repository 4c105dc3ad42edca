"""Laws without a plan: a torque from the state and the reference, computed at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.joint_pd import JointPd
from flexarm_controller.lqr import Lqr
from flexarm_controller.reference import Reference
from flexarm_controller.settings import ControllerConfig, MpcConfig
from flexarm_controller.state import ArmState
from flexarm_model.reduced_model import ReducedModel

Array = NDArray[np.float64]


class Feedback(Protocol):
    """A law that answers every state with a torque."""

    def step(self, state: ArmState, reference: Reference, sent: Array) -> Array:
        """Return the torque that follows those already ``sent``, not yet limited, (n_u,)."""
        ...


def build_feedback(model: ReducedModel, config: ControllerConfig, mpc: MpcConfig) -> Feedback | None:
    """Return the law that the settings ask for; None when it is one that plans."""
    builders: dict[str, Callable[[], Feedback]] = {
        "lqr": lambda: Lqr(model, mpc, config.period),
        "pd": lambda: JointPd(model, config, mpc.delay_periods),
    }
    return builders[config.law]() if config.law in builders else None
