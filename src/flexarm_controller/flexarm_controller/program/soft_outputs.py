"""Outputs that shall stay inside a limit: strain at the gauges, and if asked joint velocity.

``|C x + y_0| <= 1``, in units of the limit; soft, with one slack per output.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.limits import Limits
from flexarm_controller.settings import MpcConfig
from flexarm_model.reduced_model import ReducedModel

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SoftOutputs:
    """Limited outputs in units of their limits.

    Attributes:
        names: "strain:gauge.channel" or "velocity:joint.axis", (n_s,).
        C: Per state, (n_s, n_x).
        y_0: At zero state, (n_s,).
    """

    names: tuple[str, ...]
    C: Array
    y_0: Array


def build_soft_outputs(model: ReducedModel, limits: Limits, config: MpcConfig) -> SoftOutputs:
    """Take the gauge rows of the served outputs, and the velocity of limited axes.

    Raises:
        ValueError: The model has no row of the name of a limited gauge; those it has are listed.
    """
    out, n = model.outputs, model.n
    names, rows, offsets = [], [], []
    for gauge, strain in zip(limits.gauges, limits.strain, strict=True):
        if gauge not in out.names:
            raise ValueError(f"no output '{gauge}' to limit; known: {', '.join(out.names)}")
        if np.isfinite(strain):
            i, bound = out.names.index(gauge), strain * (1 - config.strain_margin)
            names.append(f"strain:{gauge}")
            rows.append(np.concatenate([out.C_pos[i], out.C_vel[i]]) / bound)
            offsets.append((out.y0[i] - out.C_pos[i] @ model.xi0) / bound)
    for j, axis in enumerate(model.theta_names):
        if config.velocity_limit and np.isfinite(limits.velocity[j]):
            names.append(f"velocity:{axis}")
            rows.append(np.eye(2 * n)[n + j] / limits.velocity[j])
            offsets.append(0.0)
    return SoftOutputs(tuple(names), np.array(rows).reshape(-1, 2 * n), np.array(offsets))
