"""Is a rearrangement what the other channels see? The channels it blames are left out, and looked at again.

An arm that is softer by 30 % and heavier by half than its model does not move as it should: turning the sign
of a gauge round may explain hundreds of squared sigmas of that, while the gauge says what the other channels
expect of it. A channel whose sign is flipped says the contrary, and of two that are swapped each says what
the others expect of the other one. Of the gauges of a 6R that were flipped the correlation, once put right,
was 0.65 to 1 (0.17 once on a 3RRR), of sound ones that would have been blamed -0.4 to -0.97.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.isolation.consistency_run import ConsistencyRun
from flexarm_estimator.isolation.hypotheses import Rearrangement
from flexarm_estimator.isolation.isolation import SETTLING
from flexarm_estimator.isolation.window import Window

Array = NDArray[np.float64]


def is_borne_out(blamed: Rearrangement, run: ConsistencyRun, window: Window, sigma: Array) -> bool:
    """Return whether the blamed channels, put right, say what the others predict for them.

    Args:
        blamed: Some channels.
        run: Over the window without these channels.
        window: What was said.
        sigma: Of the noise of every channel, by which channels of one explanation are weighed, (m,).
    """
    places = list(blamed.channels)
    settled = np.arange(len(window.y)) >= SETTLING * len(window.y)
    put_right = window.y[:, blamed.source[places]] * blamed.sign[places]
    heard = np.isfinite(put_right) & settled[:, None]
    products = put_right * run.predicted[:, places] / sigma[places] ** 2
    return float(products[heard].sum()) > 0.0
