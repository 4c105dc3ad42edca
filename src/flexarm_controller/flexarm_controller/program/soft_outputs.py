"""Outputs that shall stay inside a limit: strain at the gauges, position and velocity of the joints.

``low <= C x + y_0 <= high``, in units of the limit; soft, with one slack per output. Strain and velocity are
limited on both sides alike, a position that has two ends about their middle, one that has one end there::

    strain, velocity: |y / bound| <= 1      position: |(theta - middle) / half range| <= 1

The rows of the gauges are those of the served model, which the estimator reads its gauges with.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.limits import Limits
from flexarm_controller.settings import MpcConfig
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SoftOutputs:
    """Limited outputs in units of their limits.

    Attributes:
        names: "strain:gauge.channel", "position:joint.axis" or "velocity:joint.axis", (n_s,).
        C: Per state, (n_s, n_x).
        y_0: At zero state, (n_s,).
        low: Lower bounds, -1 or -inf, (n_s,).
        high: Upper bounds, 1 or inf, (n_s,).
    """

    names: tuple[str, ...]
    C: Array
    y_0: Array
    low: Array
    high: Array


def build_soft_outputs(model: ReducedModel, limits: Limits, config: MpcConfig) -> SoftOutputs:
    """Take the gauge rows of the served outputs, and the positions and velocities of limited axes.

    Raises:
        ValueError: The model has no row of the name of a limited gauge; those it has are listed.
    """
    kinds = [_strain(model, limits, config.strain_margin)]
    if config.position_limit:
        kinds.append(_position(model, limits))
    if config.velocity_limit:
        kinds.append(_velocity(model, limits))
    return SoftOutputs(
        tuple(name for kind in kinds for name in kind.names), np.vstack([kind.C for kind in kinds]),
        np.concatenate([kind.y_0 for kind in kinds]), np.concatenate([kind.low for kind in kinds]),
        np.concatenate([kind.high for kind in kinds]),
    )  # fmt: skip


def _strain(model: ReducedModel, limits: Limits, margin: float) -> SoftOutputs:
    out, finite = model.outputs, np.isfinite(limits.strain)
    for gauge in limits.gauges:
        if gauge not in out.names:
            raise ValueError(f"no output '{gauge}' to limit; known: {', '.join(out.names)}")
    names = [gauge for gauge, is_limited in zip(limits.gauges, finite, strict=True) if is_limited]
    rows = [out.names.index(name) for name in names]
    bound = limits.strain[finite] * (1 - margin)
    C = np.hstack([out.C_pos[rows], out.C_vel[rows]]) / bound[:, None]
    y_0 = (out.y0[rows] - out.C_pos[rows] @ model.xi0) / bound
    return _both_sides("strain", names, C, y_0)


def _position(model: ReducedModel, limits: Limits) -> SoftOutputs:
    low, high = limits.position_low, limits.position_high
    has_low, has_high = np.isfinite(low), np.isfinite(high)
    both, axes = has_low & has_high, np.flatnonzero(has_low | has_high)
    half = np.where(both, np.where(both, high - low, 2.0) / 2, 1.0)  # a position with one end is in rad or m
    middle = np.where(has_high, high - half, low + half)
    C = np.eye(model.n_theta, 2 * model.n) / half[:, None]
    return SoftOutputs(
        tuple(f"position:{model.theta_names[j]}" for j in axes), C[axes], (-middle / half)[axes],
        np.where(has_low, -1.0, -np.inf)[axes], np.where(has_high, 1.0, np.inf)[axes],
    )  # fmt: skip


def _velocity(model: ReducedModel, limits: Limits) -> SoftOutputs:
    axes = np.flatnonzero(np.isfinite(limits.velocity))
    C = np.eye(2 * model.n)[model.n + axes] / limits.velocity[axes, None]
    return _both_sides("velocity", [model.theta_names[j] for j in axes], C, np.zeros(axes.size))


def _both_sides(kind: str, names: list[str], C: Array, y_0: Array) -> SoftOutputs:
    one = np.ones(len(names))
    return SoftOutputs(tuple(f"{kind}:{name}" for name in names), C, y_0, -one, one)
