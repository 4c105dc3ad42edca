"""What the estimator node told, as the estimate that it was made of."""

from __future__ import annotations

from typing import Any, cast

import numpy as np

from flexarm_estimator.conversions import state_from_msg, tip_from_msg
from flexarm_estimator.estimate import Estimate, Status
from flexarm_estimator.state.state_layout import StateLayout


def told_estimate(state: Any, tip: Any, t: float) -> Estimate:
    """Return the estimate of a modal_state and the end_effector of the same stamp.

    Args:
        state: ModalState.
        tip: Odometry.
        t: Its instant [s].
    """
    x, P, status, sensors = state_from_msg(state)
    n_theta, n_eta = len(state.theta), len(state.eta)
    layout = StateLayout(n_theta + n_eta, n_theta, tuple(state.bias_names))
    motion = tip_from_msg(tip)
    return Estimate(
        t, state.model_id, np.array(x), np.array(P), layout, cast("Status", status), state.reason, sensors,
        state.age, motion.T_world_tip, motion.twist, motion.cov_pose, motion.cov_twist,
    )  # fmt: skip
