"""Free and driven motion of arms with loops, in both trees."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from arms import Array
from scipy.integrate import solve_ivp

from flexarm_model.tree.reduced_tree import ReducedTree

STEP = 1e-5  # of time in the difference quotient of G


def forward_dynamics(reduced: ReducedTree, q: Array, v: Array, f: Array) -> Array:
    """Return the accelerations of a reduced tree with loops, from its own mass, bias and rows, (n_q,)."""
    M, h = (np.array(part) for part in reduced.functions["motion"](q, v))
    G = reduced.constraints(q)[1]
    ahead, behind = (reduced.constraints(q + dt * v)[1] for dt in (STEP, -STEP))
    drift = (ahead - behind) @ v / (2 * STEP)
    system = np.block([[M, G.T], [G, np.zeros((reduced.n_c, reduced.n_c))]])
    return np.asarray(np.linalg.solve(system, np.concatenate([f - h, -drift]))[: reduced.n_q])


def move(
    forward: Callable[[Array, Array, Array], Array], actuated: list[int], start: Array, times: Array,
    torque: Callable[[float], Array],
) -> Any:  # fmt: skip
    """Return the coordinates at ``times``, from rest at ``start``, (k, n_q)."""
    n = start.size

    def rate(t: float, x: Array) -> Array:
        force = np.zeros(n)
        force[actuated] = torque(t)
        return np.concatenate([x[n:], forward(x[:n], x[n:], force)])

    x0 = np.concatenate([start, 0 * start])
    run = solve_ivp(rate, times[[0, -1]], x0, method="DOP853", t_eval=times, rtol=1e-8, atol=1e-10)
    return run.y[:n].T
