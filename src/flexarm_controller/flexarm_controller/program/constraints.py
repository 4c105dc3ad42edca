"""The limits as rows ``l_0 + b_now p_now <= A [v; s] <= u_0 + b_now p_now``, all of order one.

Unknowns are the torques of the blocks in units of the effort limit, and one slack per soft
output in units of that output's limit. Torque and its rate are hard: a plan that keeps them
always exists, because the torque sent before keeps them. Soft outputs are looked at when a block
ends, and may exceed their limit by the slack.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.limits import Limits
from flexarm_controller.program.penalties import Known
from flexarm_controller.program.prediction import Prediction
from flexarm_controller.program.soft_outputs import SoftOutputs

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Constraints:
    """Rows of the program.

    Attributes:
        A: Per unknown, (m, n_v + n_s).
        b_now: Shift of both bounds per known quantity but the reference, which does not matter here,
            (m, n_now).
        l: Lower bound at p = 0, (m,).
        u: Upper bound at p = 0, (m,).
        names: "torque:axis", "rate:axis", "strain:gauge", "position:axis", "velocity:axis";
            "" of a slack, (m,).
        sides: Where the limited outputs have their upper and where their lower bounds: the same rows but for
            their slacks. Those of the torques stand before them.
    """

    A: Array
    b_now: Array
    l: Array  # noqa: E741
    u: Array
    names: tuple[str, ...]
    sides: tuple[slice, slice]


class _Rows(NamedTuple):
    """Some of the rows; see ``Constraints``."""

    A: Array
    b_now: Array
    l: Array  # noqa: E741
    u: Array
    names: tuple[str, ...]


def constrain(
    prediction: Prediction, soft: SoftOutputs, limits: Limits, axes: Sequence[str], known: Known, dt: float
) -> Constraints:
    """Write the rows for control period ``dt`` [s]; ``axes`` are the names of the actuated axes."""
    n_v, n_s = prediction.G.shape[1], len(soft.names)
    torque = _torque(n_v, n_s, limits, axes, known, dt)
    upper, lower = _soft(prediction, soft, limits, known)
    parts = (torque, upper, lower, _slack(n_v, n_s, known))
    first, count = len(torque.names), len(upper.names)
    return Constraints(
        np.vstack([part.A for part in parts]), np.vstack([part.b_now for part in parts]),
        np.concatenate([part.l for part in parts]), np.concatenate([part.u for part in parts]),
        (*torque.names, *upper.names, *lower.names, *parts[-1].names),
        (slice(first, first + count), slice(first + count, first + 2 * count)),
    )  # fmt: skip


def _torque(n_v: int, n_s: int, limits: Limits, axes: Sequence[str], known: Known, dt: float) -> _Rows:
    n_u, blocks = known.n_u, n_v // known.n_u
    step = np.tile(np.minimum(limits.effort_rate * dt / limits.effort, 2.0), blocks)
    before = np.zeros((2 * n_v, known.now.stop))
    before[n_v : n_v + n_u, known.u_before] = np.diag(1 / limits.effort)
    bound = np.concatenate([np.ones(n_v), step])
    names = [f"{kind}:{axis}" for kind in ("torque", "rate") for _ in range(blocks) for axis in axes]
    itself = np.eye(n_v, n_v + n_s)
    A = np.vstack([itself, itself - np.eye(n_v, n_v + n_s, k=-n_u)])
    return _Rows(A, before, -bound, bound, tuple(names))


def _soft(prediction: Prediction, soft: SoftOutputs, limits: Limits, known: Known) -> tuple[_Rows, _Rows]:
    """Return the rows with upper and those with lower bounds."""
    n_s, n_b = len(soft.names), prediction.ends.size

    def output(states: Array) -> Array:  # (N n_x, k) -> (n_b n_s, k)
        """Return the limited outputs of columns of states."""
        stacked = states.reshape(known.N, known.n_x, -1)[prediction.ends]
        return np.asarray((soft.C @ stacked).reshape(n_b * n_s, stacked.shape[2]))

    G = output(prediction.G) * np.tile(limits.effort, n_b)
    relax = np.tile(np.eye(n_s), (n_b, 1))
    b_now = np.zeros((n_b * n_s, known.now.stop))
    b_now[:, known.x], b_now[:, known.d] = -output(prediction.F), -output(prediction.H)
    b_now[:, known.s] = -np.tile(soft.C[:, known.n_u : known.n_x // 2], (n_b, 1))
    bias = output(prediction.h)[:, 0] + np.tile(soft.y_0, n_b)
    names, open_ = n_b * soft.names, np.full(n_b * n_s, np.inf)
    low, high = np.tile(soft.low, n_b) - bias, np.tile(soft.high, n_b) - bias
    upper = _Rows(np.hstack([G, -relax]), b_now, -open_, high, names)
    return upper, _Rows(np.hstack([G, relax]), b_now, low, open_, names)


def _slack(n_v: int, n_s: int, known: Known) -> _Rows:
    itself, zero, most = np.eye(n_v + n_s)[n_v:], np.zeros(n_s), np.full(n_s, np.inf)
    return _Rows(itself, np.zeros((n_s, known.now.stop)), zero, most, ("",) * n_s)
