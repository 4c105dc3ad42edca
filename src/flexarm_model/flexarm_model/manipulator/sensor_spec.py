"""What a mounted sensor is: where it sits, what it delivers, what it may be off by. All values are SI."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class BiasSpec:
    """What a sensor's channels may be off by, each by itself: a constant that drifts.

    Attributes:
        sigma: One sigma when nothing has been learned yet, SI.
        drift: Random walk, growth of one sigma per square root of time, SI/sqrt(s).
        limit: Largest that is believed; what lies beyond it is a fault, SI.
        rate: One sigma of a steady drift, as warming up makes it; 0 for none, SI/s.
        rate_time: How long such a drift lasts [s].
    """

    sigma: float
    drift: float
    limit: float
    rate: float = 0.0
    rate_time: float = 60.0


@dataclass(frozen=True)
class SensorSpec:
    """A mounted sensor: what it is, where it sits, what it delivers.

    Attributes:
        name: Name of the sensor.
        kind: A key of ``sensor_kinds.SENSOR_KINDS``.
        site: Axis "joint.axis" of an encoder, node "body.node" of the others.
        channels: Names of its outputs, (m,).
        sigma: One-sigma noise of every channel, SI, (m,).
        rate_hz: Samples per second [Hz]; 0 means one per control period.
        latency: Age of a sample when it arrives [s].
        low, high: Smallest and largest value that is physically possible, SI.
        offset: Of a gauge from the beam's axis along y and z [m], (2,).
        limit: Largest strain allowed at a gauge [1].
        mounted: The sensor as described, which its samples are of, where some of its channels are switched
            off; None where none is.
        output: Of a gauge, what its messages hold per strain: 1, or of a bridge V/V; see ``gauge_bridge``.
        stamp_delay: Stamp minus instant of the sample: how late the driver stamps [s].
        bias: What its channels may be off by; None for nothing.
        imu: Unit whose messages carry an accelerometer or gyroscope; empty for one of its own name.
        topic: Of a camera, below ``camera/``; empty for the usual one.
        velocity: Velocity limit of the axis of an encoder [rad/s or m/s].
    """

    name: str
    kind: str
    site: str
    channels: tuple[str, ...]
    sigma: Array
    rate_hz: float = 0.0
    latency: float = 0.0
    low: float = -math.inf
    high: float = math.inf
    offset: tuple[float, float] = (0.0, 0.0)
    limit: float = math.inf
    stamp_delay: float = 0.0
    bias: BiasSpec | None = None
    imu: str = ""
    topic: str = ""
    velocity: float = math.inf
    output: float = 1.0
    mounted: SensorSpec | None = None
