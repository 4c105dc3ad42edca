"""What the modes of a changed description are off by from those that were measured.

Frequencies are compared in their order. Of modes that are nearer to each other than the frequencies are known
the order tells nothing, and of modes of one frequency every combination is a mode: of the damping of such a
group, measured or modelled, only the mean is compared.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_model.identification.described_shapes import in_size
from flexarm_model.identification.mode_table import ModeTable
from flexarm_model.identification.unknown import Unknown, changed

Array = NDArray[np.float64]
MODEL_F, MODEL_ZETA, MODEL_PHI = 5e-4, 0.02, 0.05  # relative errors that a model may have anyway
APART = 3.0  # sigmas of a difference of frequencies from which it is known which mode is which

Serve = Callable[[Mapping[str, str | float], Array], tuple[Array, ...]]
"""Frequencies [Hz], damping ratios [1], perhaps shapes of the changed description at a pose, slowest first.

Shapes are (modes, n_out), of the slowest modes; where a table has none they are not looked at.
"""


def misfit(
    serve: Serve, unknowns: Sequence[Unknown], tables: Sequence[ModeTable], x: Array
) -> tuple[Array, Array]:
    """Return the errors of all that is known, in sigmas, and ln of model over measured frequency.

    Args:
        serve: Modes of the changed description.
        unknowns: What is changed.
        tables: The measured modes, of a pose each.
        x: ln of new over old value, (n_unknowns,).

    Raises:
        ValueError: There is no such model, or it has fewer modes than a table.
    """
    changes = changed(unknowns, x)
    weighted, logs = [], []
    for table in tables:
        f_hz, zeta, *shapes = serve(changes, table.pose)
        if f_hz.size < table.f_hz.size:
            raise ValueError(f"{table.f_hz.size} modes were measured, the model has {f_hz.size}")
        f_hz, zeta = f_hz[: table.f_hz.size], zeta[: table.f_hz.size]
        log_f = np.log(f_hz / table.f_hz)
        s_f = np.hypot(np.nan_to_num(table.f_std_hz) / table.f_hz, MODEL_F)
        weighted += [log_f[np.isfinite(log_f)] / s_f[np.isfinite(log_f)], _of_damping(f_hz, zeta, table, s_f)]
        weighted += [_of_shapes(each, table) for each in shapes if table.shapes.size]
        logs.append(log_f[np.isfinite(log_f)])
    return np.concatenate(weighted), np.concatenate(logs)


def _of_damping(f_hz: Array, zeta: Array, table: ModeTable, s_f: Array) -> Array:
    """Return the weighted errors of the damping ratios that are known, the same for all of a group.

    Args:
        f_hz: Frequencies of the model [Hz], (r,).
        zeta: Its damping ratios [1], (r,).
        table: The measured ones, (r,).
        s_f: One sigma of ln f, (r,).
    """
    known = np.flatnonzero(np.isfinite(table.zeta) & np.isfinite(table.f_hz))
    if not known.size:
        return np.zeros(0)
    sure = APART * np.hypot(s_f[known][1:], s_f[known][:-1])
    apart = [abs(np.diff(np.log(each[known]))) > sure for each in (f_hz, table.f_hz)]
    starts = np.flatnonzero(np.r_[True, np.logical_and(*apart)])
    count = np.diff(np.r_[starts, known.size])
    seen, measured = (np.add.reduceat(each[known], starts) / count for each in (zeta, table.zeta))
    variance = np.add.reduceat(np.nan_to_num(table.zeta_std[known]) ** 2, starts) / count**2
    sigma = np.hypot(np.sqrt(variance) / measured, MODEL_ZETA) * np.sqrt(count)
    return np.repeat(np.log(np.maximum(seen, 1e-12) / measured) / sigma, count)


def _of_shapes(shapes: Array, table: ModeTable) -> Array:
    """Return the weighted errors of the shapes that are known, either sign allowed."""
    count = min(len(shapes), len(table.shapes))
    measured, seen = table.shapes[:count], in_size(shapes[:count], table.size)
    known = np.isfinite(measured).all(axis=1)
    measured, seen = measured[known], seen[known]
    signs = np.where(np.sum(measured * seen, axis=1, keepdims=True) < 0.0, -1.0, 1.0)
    return np.asarray((signs * seen - measured).ravel() / MODEL_PHI)
