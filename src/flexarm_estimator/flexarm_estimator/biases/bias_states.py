"""Biases of sensors as states: a gauge drifts with temperature, an accelerometer has an offset.

    b' = r + w_b      r' = -r / T + w_r      y = C x + b + ...

appended to the state of the served model: one state b for every channel, and behind them one r for each that
warms up, its rate of drift, of deviation ``rate`` and memory ``T = rate_time``. A gauge that warms up by the
minute is followed without lag then, though its bias is hardly believed to change from one second to the next.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from flexarm_model.manipulator.sensor_spec import BiasSpec, SensorSpec
from flexarm_model.numeric.dense import block_diagonal
from flexarm_model.served.state_space import StateSpace

_FAR = 10.0  # sigmas; a rate is held within


@dataclass(frozen=True)
class BiasState:
    """A state of a bias.

    Attributes:
        row: Output row "sensor.channel" that it belongs to.
        is_rate: It is the rate of the bias, not the bias.
        sigma: One sigma at the start, SI.
        drift: Intensity of its noise, SI/sqrt(s).
        limit: It is held within, SI.
        decay: Inverse of its memory [1/s].
    """

    row: str
    is_rate: bool
    sigma: float
    drift: float
    limit: float
    decay: float = 0.0


def bias_specs(sensors: Iterable[SensorSpec]) -> dict[str, BiasSpec]:
    """Return what every output row "sensor.channel" may be off by, for those that have a bias."""
    return {
        f"{spec.name}.{channel}": spec.bias
        for spec in sensors
        if spec.bias is not None
        for channel in spec.channels
    }


def bias_states(biases: Mapping[str, BiasSpec]) -> dict[str, BiasState]:
    """Return the states by name: biases as their rows, then "sensor.channel rate" of those that warm up."""
    states = {row: BiasState(row, False, bias.sigma, bias.drift, bias.limit) for row, bias in biases.items()}
    for row, bias in biases.items():
        if bias.rate > 0.0:
            walk = bias.rate * np.sqrt(2.0 / bias.rate_time)  # keeps the deviation
            states[f"{row} rate"] = BiasState(
                row, True, bias.rate, float(walk), _FAR * bias.rate, 1.0 / bias.rate_time
            )
    return states


def with_biases(system: StateSpace, rows: tuple[str, ...], states: Mapping[str, BiasState]) -> StateSpace:
    """Return a continuous system with biases appended to its state.

    Args:
        system: Without them.
        rows: Names "sensor.channel" of its outputs, (n_y,).
        states: Of the biases, those of some of these rows.
    """
    n_b = len(states)
    if not n_b:
        return system
    names = tuple(states)
    added, A = np.zeros((len(rows), n_b)), np.zeros((n_b, n_b))
    for i, state in enumerate(states.values()):
        A[i, i] = -state.decay
        if state.is_rate:
            A[names.index(state.row), i] = 1.0
        else:
            added[rows.index(state.row), i] = 1.0
    drift = np.array([state.drift for state in states.values()])
    return replace(
        system,
        A=block_diagonal(system.A, A),
        B=np.vstack([system.B, np.zeros((n_b, system.n_u))]),
        c=np.append(system.c, np.zeros(n_b)),
        Q=block_diagonal(system.Q, np.diag(drift**2)),
        C=np.hstack([system.C, added]),
    )
