"""Rule for the margins: the roll-off of the modal weights starts earlier until every margin is kept.

The gate closes the loop of filter, law and delay on the arm with more modes than are served, with frequencies
off either way. Where something falls short, the modes above the cut-off are left to their own damping more
and more; when that does not help any further, torque is made dearer, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.margins.study import Loop
from flexarm_controller.settings import ControllerConfig, MpcConfig
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.description import ManipulatorConfig

Array = NDArray[np.float64]
SHRINK = 0.8  # of the cut-off or of what torque may be, at once
ROLL_OFFS, PRICES = 4, 4  # times, at most


@dataclass(frozen=True)
class Kept:
    """Weights whose margins were looked at.

    Attributes:
        mpc: The weights.
        tries: How often they were made weaker.
        trouble: What still falls short; empty when nothing does.
    """

    mpc: MpcConfig
    tries: int
    trouble: str


def keep_margins(
    config: ManipulatorConfig,
    estimator: EstimatorConfig,
    laws: tuple[ControllerConfig, MpcConfig],
    poses: Sequence[Array],
) -> Kept:
    """Return the weights, weakened until the margins at all poses are kept."""
    law, mpc = laws
    for tries in range(ROLL_OFFS + PRICES + 1):
        loop = Loop(config, estimator, (law, mpc))
        trouble = next((text for text in map(loop.judge, poses) if text), "")
        if not trouble or tries == ROLL_OFFS + PRICES:
            break
        if tries < ROLL_OFFS:
            mpc = replace(mpc, modal_cutoff_hz=mpc.modal_cutoff_hz * SHRINK)
        else:
            mpc = replace(mpc, input_acceleration=mpc.input_acceleration * SHRINK)
    return Kept(mpc, tries, trouble)
