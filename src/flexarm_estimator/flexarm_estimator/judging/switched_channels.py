"""Channels of a sensor that are switched off by hand: its description, and its samples, without them.

A sensor whose channels are not all in use is described with those that are; ``SensorSpec.mounted`` is what
its samples hold. So whatever is made of the description knows nothing of the others.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.measurement import Measurement
from flexarm_model.manipulator.sensor_kinds import SENSOR_KINDS
from flexarm_model.manipulator.sensor_spec import SensorSpec


def all_channels(spec: SensorSpec) -> tuple[str, ...]:
    """Return the channels of a sensor, those that are off, too."""
    return (spec.mounted or spec).channels


def switch(spec: SensorSpec, channels: Iterable[str], is_on: bool) -> SensorSpec:
    """Return a sensor with some of its channels in use or not; noise that was set stays.

    Raises:
        ValueError: It has no such channel, or cannot be without the others; says what is allowed.
    """
    mounted, asked = spec.mounted or spec, set(channels)
    if strangers := sorted(asked - set(mounted.channels)):
        raise ValueError(f"no channel '{strangers[0]}'; allowed: {', '.join(mounted.channels)}")
    wanted = asked | set(spec.channels) if is_on else set(spec.channels) - asked
    left = tuple(channel for channel in mounted.channels if channel in wanted)
    if not left:
        raise ValueError("none would be left; allowed: no channels, which switches the whole sensor off")
    if misfit := SENSOR_KINDS[spec.kind].misfit(left):
        raise ValueError(f"{', '.join(left)} would be left; {misfit}")
    whole = left == mounted.channels
    return replace(
        mounted, channels=left, sigma=_sigma(spec, mounted, left), mounted=None if whole else mounted
    )


def have_same_channels(specs: Sequence[SensorSpec], others: Sequence[SensorSpec]) -> bool:
    """Return whether the same sensors, in the same order, have the same channels in use."""
    return [spec.channels for spec in specs] == [other.channels for other in others]


class Narrowing:
    """Leaves out of samples what is switched off."""

    def __init__(self, specs: Iterable[SensorSpec]) -> None:
        """Find the sensors that are not whole."""
        self._kept = {
            spec.name: ([spec.mounted.channels.index(c) for c in spec.channels], len(spec.mounted.channels))
            for spec in specs
            if spec.mounted is not None
        }

    def narrow(self, samples: Sequence[Measurement]) -> Sequence[Measurement]:
        """Return the samples with the channels that are in use; of one of another length nothing is left."""
        if not self._kept:
            return samples
        return [self._narrow(sample) for sample in samples]

    def _narrow(self, sample: Measurement) -> Measurement:
        kept, m = self._kept.get(sample.sensor, ([], 0))
        if not kept:
            return sample
        y, R = sample.y, sample.R
        if not isinstance(y, np.ndarray) or y.shape != (m,):  # it must not pass for a narrow one
            return sample._replace(y=np.empty(0))
        if isinstance(R, np.ndarray):  # of another shape likewise
            R = R[np.ix_(kept, kept)] if R.shape == (m, m) else np.empty((0, 0))
        return sample._replace(y=y[kept], R=R)


def _sigma(spec: SensorSpec, mounted: SensorSpec, channels: Sequence[str]) -> NDArray[np.float64]:
    """Return the noise of some channels: as last set, of those that were off as described, (m,)."""
    known = dict(zip(mounted.channels, mounted.sigma, strict=True))
    known |= dict(zip(spec.channels, spec.sigma, strict=True))
    return np.array([known[channel] for channel in channels])
