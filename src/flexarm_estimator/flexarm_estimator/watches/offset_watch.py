"""Tells when the tip is seen elsewhere than the other sensors and the model say, all the time.

The zero of an encoder, a camera that is mounted a little off, a load that the description does not have:
each single frame is possible, so the gate lets it pass, and noise has no part in it. The innovations of a
sensor of poses are averaged over blocks; a channel that was off by much in one direction for ``_BLOCKS`` of
them in a row is told. Only told: no sample says who is right. Other kinds are left alone: on an arm that is
not as described gauges and accelerometers are off by several sigma for seconds, and the tip is where it
should be.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.judging.sample_judge import Verdict
from flexarm_estimator.parts import Parts
from flexarm_estimator.state.sensors import MeasurementModel
from flexarm_estimator.watches.watch import Finding, View, Watch
from flexarm_model.manipulator.sensor_kinds import POSE_UNITS

Array = NDArray[np.float64]
_BLOCK = 0.5  # s over which innovations are averaged
_BLOCKS = 4  # in a row
_ENOUGH = 5  # samples in a block, at least
_MUCH = 1.5  # sigma of one sample; sound sensors stay below 0.7, on an arm 50 % too heavy, too
_LITTLE = 0.75  # sigma: what was told is over


class _Means:
    """Means of a sensor's innovations over the last blocks.

    Attributes:
        size: Channels.
        is_told: An offset was told.
    """

    def __init__(self, t: float, size: int, is_told: bool = False) -> None:
        """Begin the first block at ``t`` [s]."""
        self.size, self.is_told, self._start = size, is_told, t
        self._count, self._total = 0, np.zeros(size)
        self._blocks = np.zeros((_BLOCKS, size))

    def add(self, innovation: Array, t: float) -> bool:
        """Take an innovation, SI (size,), at ``t`` [s]; return whether it completes a block."""
        self._total += innovation
        self._count += 1
        if t - self._start < _BLOCK or self._count < _ENOUGH:
            return False
        self._blocks = np.vstack([self._blocks[1:], self._total / self._count])
        self._start, self._count = t, 0
        self._total[:] = 0.0
        return True

    def steady(self) -> Array:
        """Return by how much each channel was off in all blocks, at least and with its sign, SI (size,)."""
        low, high = self._blocks.min(axis=0), self._blocks.max(axis=0)
        return np.asarray(np.maximum(low, 0.0) + np.minimum(high, 0.0))


class OffsetWatch(Watch):
    """Watches the mean of what sensors of poses say."""

    def __init__(self) -> None:
        """Begin without any mean."""
        self._means: dict[str, _Means] = {}

    def use(self, parts: Parts) -> None:
        """See Watch."""
        self._models = parts.sensors.poses

    def restart(self, t: float) -> None:
        """See Watch."""
        self._means = {}

    def look(self, view: View) -> Sequence[Finding]:
        """See Watch."""
        findings: list[Finding] = []
        for verdict in view.verdicts:
            model = self._models.get(verdict.sensor)
            if model is None or not verdict.is_accepted:
                continue
            means = self._means_of(verdict, view.t)
            if means.add(verdict.innovation, view.t):
                findings += _judge(model, means)
        return findings

    def _means_of(self, verdict: Verdict, t: float) -> _Means:
        """Return the means of a sensor, new ones where it has other channels than before."""
        sensor, size = verdict.sensor, verdict.innovation.size
        means = self._means.get(sensor)
        if means is None or means.size != size:
            means = self._means[sensor] = _Means(t, size, means is not None and means.is_told)
        return means


def _judge(model: MeasurementModel, means: _Means) -> list[Finding]:
    """Return what is new about a sensor that has completed a block."""
    steady, was_told = means.steady(), means.is_told
    sigmas = np.abs(steady) / np.sqrt(model.R.diagonal())
    worst = int(sigmas.argmax())
    means.is_told = bool(sigmas[worst] > (_LITTLE if was_told else _MUCH))
    if means.is_told == was_told:
        return []
    channel = model.channels[worst]
    off = f"{steady[worst]:.2g} {POSE_UNITS[channel]} in {channel}"
    return [Finding(model.name, f"is off by {off} all the time" if means.is_told else "")]
