"""Rule for the weights of the predictive law: the same deviation of the tip costs the same.

Deviations that cost the same are physical sizes. The tip may be out by as much as before, so the energy of
the modes goes with their stiffness at the tip; the roll-off stays above the same modes. Both ratios are
geometric means over the modes that count. What joints may be off and torques may be is left: that is a matter
of task and motors, which no modal test has changed.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.retune.arm_facts import ArmFacts
from flexarm_controller.settings import MpcConfig

Array = NDArray[np.float64]


def scale_weights(mpc: MpcConfig, before: ArmFacts, after: ArmFacts) -> MpcConfig:
    """Return the settings with the weights for the arm as it is.

    Args:
        mpc: Settings that fit the arm as it was described.
        before: The arm then.
        after: The arm now, with as many modes.
    """
    counting = before.f_hz <= max(mpc.modal_cutoff_hz, float(before.f_hz[0]))
    ratio = _mean_ratio(after.f_hz, before.f_hz, counting)
    felt = counting & np.isfinite(before.tip_stiffness) & np.isfinite(after.tip_stiffness)
    stiffer = _mean_ratio(after.tip_stiffness, before.tip_stiffness, felt) if felt.any() else ratio**2
    return replace(
        mpc,
        modal_energy=mpc.modal_energy * stiffer,
        modal_cutoff_hz=mpc.modal_cutoff_hz * ratio,
    )


def _mean_ratio(after: Array, before: Array, among: NDArray[np.bool_]) -> float:
    return float(np.exp(np.mean(np.log(after[among] / before[among]))))
