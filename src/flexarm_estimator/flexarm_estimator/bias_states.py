"""Biases of sensors as states: a gauge drifts with temperature, an accelerometer has an offset.

    b' = w      y = C x + b + ...      w white, intensity drift^2

appended to the state of the served model, one state for every channel.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from flexarm_model.description import BiasSpec, SensorSpec
from flexarm_model.state_space import StateSpace

Array = NDArray[np.float64]


def bias_specs(sensors: Iterable[SensorSpec]) -> dict[str, BiasSpec]:
    """Return what every output row "sensor.channel" may be off by, for those that have a bias."""
    return {
        f"{spec.name}.{channel}": spec.bias
        for spec in sensors
        if spec.bias is not None
        for channel in spec.channels
    }


def with_biases(system: StateSpace, rows: tuple[str, ...], biases: Mapping[str, BiasSpec]) -> StateSpace:
    """Return a continuous system with biases appended to its state.

    Args:
        system: Without them.
        rows: Names "sensor.channel" of its outputs, (n_y,).
        biases: Of some of these rows, in the order of their states.
    """
    n_b = len(biases)
    if not n_b:
        return system
    added = np.zeros((len(rows), n_b))
    added[[rows.index(name) for name in biases], np.arange(n_b)] = 1.0
    drift = np.array([bias.drift for bias in biases.values()])
    still = np.zeros((n_b, n_b))
    return replace(
        system,
        A=block_diag(system.A, still),
        B=np.vstack([system.B, np.zeros((n_b, system.n_u))]),
        c=np.append(system.c, np.zeros(n_b)),
        Q=block_diag(system.Q, np.diag(drift**2)),
        C=np.hstack([system.C, added]),
    )
