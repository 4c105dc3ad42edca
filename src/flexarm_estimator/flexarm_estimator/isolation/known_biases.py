"""What is known of the biases where a window begins.

A run of the filter starts broadly, and a bias that may be anything hides what a gauge tells of how far the
arm bends: whether its sign is flipped, or whether it is there at all. The estimator has learned its biases
from what came before. They count for what they were then, known to as many sigmas of the noise as make no
channel faulty at best: of what is wrong with one channel others have learned some, too.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filter import Belief
from flexarm_estimator.isolation.channels import Channels
from flexarm_estimator.parts import Parts

Array = NDArray[np.float64]
_SURE = 5.0  # sigmas of a channel's noise


def told_biases(belief: Belief, parts: Parts) -> Array:
    """Return mean and variance of the biases in a state, (2, n_b)."""
    b = parts.layout.b
    return np.array([belief.x[b], belief.P.diagonal()[b]])


def known_biases(told: Array, parts: Parts, channels: Channels) -> Array:
    """Return mean and variance (2, n_b) with which a run over a window begins that such a state precedes.

    Args:
        told: Mean and variance in that state, (2, n_b).
        parts: In use there.
        channels: All of them; a bias of none is left as broad as at the start.
    """
    mean, variance = told
    start = parts.process.P0.diagonal()[parts.layout.b]
    sure = np.array([_variance(name, parts, channels) for name in parts.layout.biases])
    return np.array([mean, np.minimum(np.maximum(variance, sure), start)])


def _variance(bias: str, parts: Parts, channels: Channels) -> float:
    """Return down to which variance a bias "sensor.channel" counts as known."""
    sensor, _, channel = bias.rpartition(".")
    model = parts.sensors.rows.get(sensor)
    if model is None or channel not in model.channels:
        return np.inf
    return float((_SURE * channels.sigma[channels.spans[sensor].start + model.channels.index(channel)]) ** 2)
