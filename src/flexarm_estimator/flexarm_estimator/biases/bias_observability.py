r"""Which biases the mounted sensors can tell from what else stands still.

A bias is constant, a motion of the arm that looks like one makes it unobservable: a wrong encoder is an arm
that stands elsewhere, unless a camera or a second encoder tells. All such motions are polynomials in time,
``xi = xi_0 + xi_1 t + xi_2 t^2/2`` (an axis under a constant unmodelled torque ``d`` gets no further), so

    K xi_2 = 0     K xi_1 + D xi_2 = 0     K xi_0 + D xi_1 + M xi_2 = B d
    C_p xi_2 = 0   C_p xi_1 + C_v xi_2 = 0   C_p xi_0 + C_v xi_1 + C_a xi_2 + b = 0

has a solution with this bias in it. It is the rank test of Popov, Belevitch and Hautus at s = 0
([Hautus1969], collected in docs/references.md) with its Jordan chains, on rows and columns of equal size.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.biases.bias_states import bias_specs
from flexarm_model.manipulator.sensor_spec import SensorSpec
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]
_RANK = 1e-9  # of the largest singular value
_SHARE = 1e-6  # of a solution of unit length; less is rounding
_TOOL = "tip"  # rows of what a camera sees


def observable_biases(model: ReducedModel, sensors: Iterable[SensorSpec]) -> tuple[str, ...]:
    """Return the rows "sensor.channel" whose bias can be learned, in the order of the sensors.

    Args:
        model: Served model.
        sensors: All that are mounted; those without a bias are what the others are compared with.

    Raises:
        KeyError: The model has no output row of a sensor.
    """
    sensors = tuple(sensors)
    names = tuple(bias_specs(sensors))
    if not names:
        return ()
    rows, tells = _rows(model, sensors), model.outputs.names
    hidden = _hidden_solutions(model, rows, [rows.index(tells.index(name)) for name in names])
    share = np.linalg.norm(hidden[-len(names) :], axis=1)  # whatever basis the solutions are written in
    return tuple(name for name, part in zip(names, share, strict=True) if part < _SHARE)


def _rows(model: ReducedModel, sensors: tuple[SensorSpec, ...]) -> list[int]:
    """Return the output rows that are measured; a pose sensor measures those of the tool."""
    found, places = list[int](), {name: i for i, name in enumerate(model.outputs.names)}
    for spec in sensors:
        owner = spec.name if spec.name in model.outputs.sensors else _TOOL
        found += [places[f"{owner}.{channel}"] for channel in spec.channels]
    return list(dict.fromkeys(found))


def _hidden_solutions(model: ReducedModel, rows: list[int], biased: list[int]) -> Array:
    """Return the motions that no sensor sees, [xi_0; xi_1; xi_2; d; b] by columns."""
    out, n, n_d, n_b = model.outputs, model.n, model.n_theta, len(biased)
    dynamics = np.zeros((3 * n, 3 * n + n_d + n_b))
    seen = np.zeros((3 * len(rows), 3 * n + n_d + n_b))
    parts = (model.K, model.D, model.M), (out.C_pos[rows], out.C_vel[rows], out.C_acc[rows])
    for target, coefficients in zip((dynamics, seen), parts, strict=True):
        m = coefficients[0].shape[0]
        for power in range(3):
            for k, block in enumerate(coefficients[: 3 - power]):
                at = (power + k) * n
                target[power * m : (power + 1) * m, at : at + n] = block
    dynamics[:n, 3 * n : 3 * n + n_d] = -model.B
    seen[biased, 3 * n + n_d + np.arange(n_b)] = 1.0
    return _null_space(np.vstack([dynamics, seen]))


def _null_space(equations: Array) -> Array:
    """Return an orthonormal basis of what solves them, columns scaled to one size."""
    height = np.linalg.norm(equations, axis=1)
    even = equations[height > 0.0] / height[height > 0.0][:, None]
    width = np.linalg.norm(even, axis=0)
    even = even / np.where(width > 0.0, width, 1.0)
    _, sigma, V = np.linalg.svd(even)
    rank = int(np.count_nonzero(sigma > _RANK * sigma[0]))
    return np.asarray(V[rank:].T)
