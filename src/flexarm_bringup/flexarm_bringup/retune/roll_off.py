"""Rule for the margins: the roll-off of the modal weights starts earlier until every margin is kept.

The gate closes the loop of filter, law and delay on the arm with more modes than are served, with frequencies
off either way. Where something falls short, the modes above the cut-off are left to their own damping more
and more; when that does not help any further, torque is made dearer, too. Where nothing helps at some pose,
the strongest weights are taken with which the fewest poses fall short.

A law whose firm weights the gate refuses does without them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.margins.loop import Loop
from flexarm_controller.settings import ControllerConfig, MpcConfig
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.manipulator.description import ManipulatorConfig

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
        poses: At which nothing does, each (n_theta,).
    """

    mpc: MpcConfig
    tries: int
    trouble: str
    poses: tuple[Array, ...]


def keep_margins(
    config: ManipulatorConfig,
    estimator: EstimatorConfig,
    laws: tuple[ControllerConfig, MpcConfig],
    poses: Sequence[Array],
) -> Kept:
    """Return the weights, weakened until the margins at all poses are kept."""
    best = _look(config, estimator, laws, poses, 0)
    if best.trouble and laws[1].firm_time:
        found = _look(config, estimator, (laws[0], replace(laws[1], firm_time=0.0)), poses, 0)
        best = found if len(found.poses) > len(best.poses) else best
    mpc = best.mpc
    for tries in range(1, ROLL_OFFS + PRICES + 1):
        if not best.trouble:
            break
        if tries <= ROLL_OFFS:
            mpc = replace(mpc, modal_cutoff_hz=mpc.modal_cutoff_hz * SHRINK)
        else:
            mpc = replace(mpc, input_acceleration=mpc.input_acceleration * SHRINK)
        found = _look(config, estimator, (laws[0], mpc), poses, tries)
        best = found if len(found.poses) > len(best.poses) else best
    return best


def _look(
    config: ManipulatorConfig,
    estimator: EstimatorConfig,
    laws: tuple[ControllerConfig, MpcConfig],
    poses: Sequence[Array],
    tries: int,
) -> Kept:
    loop = Loop(config, estimator, laws)
    found = [loop.judge(pose) for pose in poses]
    good = tuple(pose for pose, trouble in zip(poses, found, strict=True) if not trouble)
    return Kept(laws[1], tries, next(filter(None, found), ""), good)
