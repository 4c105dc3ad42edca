"""Where an arm without loops comes to rest, from any start: Newton's step with the sign of every curvature.

Newton's iteration goes to the next place where forces balance, a pendulum's upper one too, or away. Along a
motion phi with ``K phi = M phi k`` and the force r, ``-r / |k|`` goes down the potential instead.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from flexarm_model.numeric.dense import eigh

Array = NDArray[np.float64]
Settled = tuple[
    Array, Array, tuple[Array, ...]
]  # coordinates, forces in loops; mass, damping, stiffness, forces

ITERATIONS = 100
LONGEST = 0.3  # of a step: rad, m, or a modal coordinate
SLOWEST = 1e-6  # of the largest curvature: smaller ones are taken for it
FLATTEST = 1e-3  # of the largest force: what stands in for a curvature where there is none
KICK = 1e-3  # rad, m, or a modal coordinate: off a place where forces balance and a motion is unstable
BALANCED = 1e-6  # unbalanced force, relative to the largest one: Newton's iteration does the rest


def come_to_rest(linearisation: Callable[[Array], tuple[Array, ...]], q: Array, e: Array) -> Array | None:
    """Return the coordinates near a stable equilibrium, (n_q,); None where none is found.

    Args:
        linearisation: Gives mass, damping, stiffness (n_q, n_q) and forces (n_q,) at q.
        q: Start, (n_q,).
        e: Indices of the coordinates that are free.
    """
    q, inner = q.copy(), np.ix_(e, e)
    for _ in range(ITERATIONS):
        M, _, K, f = linearisation(q)
        try:
            k, Phi = eigh((K + K.T)[inner] / 2, (M + M.T)[inner] / 2)
        except np.linalg.LinAlgError:
            return None
        balanced = abs(f[e]).max() <= BALANCED * max(1.0, abs(f).max())
        if balanced and (k[0] > 0.0 or not k.any()):
            return q if k[0] > 0.0 else None
        r = Phi.T @ f[e]
        step = -Phi @ (r / np.maximum(abs(k), max(SLOWEST * abs(k).max(), FLATTEST * abs(r).max())))
        if balanced:
            step = Phi[:, 0] * KICK / abs(Phi[:, 0]).max()
        q[e] += step * LONGEST / max(abs(step).max(), LONGEST)
    return None


def is_stable(K: Array, e: Array) -> bool:
    """Return whether every free motion is pushed back by the stiffness (n_q, n_q)."""
    return bool(np.linalg.eigvalsh((K + K.T)[np.ix_(e, e)])[:1].min(initial=1.0) > 0.0)
