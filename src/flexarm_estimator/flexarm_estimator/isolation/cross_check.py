"""Is a rearrangement what the other channels see? The channels it blames are left out, and looked at again.

An arm that is softer by 30 % and heavier by half than its model does not move as it should: turning the sign
of a gauge round may explain hundreds of squared sigmas of that, while the gauge says what the other channels
expect of it. A channel whose sign is flipped says the contrary, and of two that are swapped each says what
the others expect of the other one. They are asked by how many squared sigmas of what they expect the blamed
channels are nearer to it once they are put right. With channels that were flipped or swapped these were 1.3
(gauges of a 6R at rest) to 50 000. Where the others can hardly tell, as of the encoders of two wrist axes
that turn alike, it is a thousandth, and what explains them better may be another error of the model.
"""

from __future__ import annotations

import numpy as np

from flexarm_estimator.isolation.consistency_run import ConsistencyRun
from flexarm_estimator.isolation.hypotheses import Rearrangement
from flexarm_estimator.isolation.isolation import SETTLING
from flexarm_estimator.isolation.window import Window

_TELLING = 0.5  # squared sigmas


def is_borne_out(blamed: Rearrangement, run: ConsistencyRun, window: Window) -> bool:
    """Return whether the blamed channels are nearer to what the others predict once they are put right.

    Args:
        blamed: Some channels.
        run: Over the window without these channels.
        window: What was said.
    """
    places = list(blamed.channels)
    settled = np.arange(len(window.y)) >= SETTLING * len(window.y)
    as_said, predicted = window.y[settled][:, places], run.predicted[settled][:, places]
    put_right = window.y[settled][:, blamed.source[places]] * blamed.sign[places]
    if window.biases is not None:  # what is predicted counts on the biases as they are if all is well
        put_right = put_right - window.biases.shift(blamed)[places]
    nearer = (as_said - predicted) ** 2 - (put_right - predicted) ** 2
    return float(np.nansum(nearer / run.variance[settled][:, places])) >= _TELLING
