"""What is known of the biases where a window begins.

A run of the filter starts broadly, and a bias that may be anything hides what a gauge tells of how far the
arm bends: whether its sign is flipped, or whether it is there at all. The estimator has learned its biases
from what came before. They count for what they were then, known to as many sigmas of the noise as make no
channel faulty at best: of what is wrong with one channel others have learned some, too.

A bias is one of what was said. Where a channel says the opposite, so does its bias, and two that are swapped
have swapped their biases, too: a bridge that is not zeroed would speak against every such hypothesis.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filter import Belief
from flexarm_estimator.isolation.channels import Channels
from flexarm_estimator.isolation.hypotheses import Hypotheses, Rearrangement
from flexarm_estimator.parts import Parts

Array = NDArray[np.float64]
_SURE = 5.0  # sigmas of a channel's noise
_NO_CHANNEL = -1


class KnownBiases(NamedTuple):
    """What is known of the biases of one model.

    Attributes:
        mean, variance: (n_b,).
        channel: That each belongs to, -1 for a rate of drift, (n_b,).
    """

    mean: Array
    variance: Array
    channel: NDArray[np.intp]

    def under(self, hypotheses: Hypotheses) -> Array:
        """Return the means were a hypothesis true, (n_b, n_h)."""
        means, own = np.repeat(self.mean[:, None], len(hypotheses.all), axis=1), self.channel > _NO_CHANNEL
        said = self._by_channel(len(hypotheses.source))
        means[own] = (said[hypotheses.source] * hypotheses.sign)[self.channel[own]]
        return means

    def shift(self, one: Rearrangement) -> Array:
        """Return by how much other biases move what is predicted of the channels were it true, (m,)."""
        said = self._by_channel(len(one.source))
        has_bias = np.isin(np.arange(said.size), self.channel)
        return np.where(has_bias, said[one.source] * one.sign - said, 0.0)

    def _by_channel(self, m: int) -> Array:
        """Return the mean that each channel has, 0 without a bias, (m,)."""
        own, said = self.channel > _NO_CHANNEL, np.zeros(m)
        said[self.channel[own]] = self.mean[own]
        return said


def told_biases(belief: Belief, parts: Parts) -> Array:
    """Return mean and variance of the biases in a state, (2, n_b)."""
    b = parts.layout.b
    return np.array([belief.x[b], belief.P.diagonal()[b]])


def known_biases(told: Array, parts: Parts, channels: Channels) -> KnownBiases:
    """Return with what a run over a window begins that such a state precedes.

    Args:
        told: Mean and variance in that state, (2, n_b).
        parts: In use there.
        channels: All of them; a bias of none is left as broad as at the start.
    """
    mean, variance = told
    start = parts.process.P0.diagonal()[parts.layout.b]
    places = [_channel(name, parts, channels) for name in parts.layout.biases]
    sure = [np.inf if i == _NO_CHANNEL else (_SURE * float(channels.sigma[i])) ** 2 for i in places]
    counts = np.minimum(np.maximum(variance, sure), start)
    return KnownBiases(mean, counts, np.array(places, dtype=np.intp))


def _channel(bias: str, parts: Parts, channels: Channels) -> int:
    """Return which channel a bias "sensor.channel" belongs to; -1 for none."""
    sensor, _, channel = bias.rpartition(".")
    model = parts.sensors.rows.get(sensor)
    if model is None or channel not in model.channels:
        return _NO_CHANNEL
    return int(channels.spans[sensor].start + model.channels.index(channel))
