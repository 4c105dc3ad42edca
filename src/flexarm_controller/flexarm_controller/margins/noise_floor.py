"""What the sensors' noise does to an arm at rest, sent through filter and law: less vibration no law leaves.

The samples of the settled filter carry noise ``n`` with standard deviations ``sigma``. With the closed loop
``z+ = A z`` of ``loop``, L the filter's gain, and a signal that is looked at through a filter of its own::

    z+ = A z + [0; L; 0] n      y = C x_p + E b u      w+ = A_w w + B_w y      s = C_w w + D_w y

the covariance of ``[z; w]`` settles, ``P = A P A' + G G'`` (discrete Lyapunov equation), and the signal's RMS
is the root of ``c P c'``. Exact where no limit binds; the arm needs no reference and nothing is simulated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_discrete_lyapunov

from flexarm_controller.margins.full_plant import FullPlant
from flexarm_controller.margins.loop import ClosedLoop
from flexarm_model.served.steady_filter import SteadyFilter

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Look:
    """How every channel of a signal is filtered before its RMS is taken; one channel as state space.

    Attributes:
        A: (k, k).
        B: (k, 1).
        C: (1, k).
        D: (1, 1).
    """

    A: Array
    B: Array
    C: Array
    D: Array


def noise_floor(loop: ClosedLoop, filter_: SteadyFilter, sigma: Array, seen: FullPlant, look: Look) -> Array:
    """Return the RMS of every channel of a signal at rest, (n_s,), in its own unit.

    Args:
        loop: Closed; its plant's modes are those of ``seen``.
        filter_: The filter in it.
        sigma: Standard deviations of the samples that it takes, (n_y,).
        seen: The same plant with the signal's rows instead of the sensors'.
        look: What the signal passes.

    Raises:
        ValueError: The loop is not stable, so nothing settles.
    """
    if abs(np.linalg.eigvals(loop.A)).max() >= 1.0:
        raise ValueError("the loop is not stable")
    n_z, n_p, n_s = len(loop.A), len(seen.A), len(seen.C)
    C = seen.E @ seen.b @ loop.torque
    C[:, :n_p] += seen.C
    each = np.eye(n_s)
    A_w, B_w, C_w, D_w = (np.kron(each, part) for part in (look.A, look.B, look.C, look.D))
    A = np.block([[loop.A, np.zeros((n_z, len(A_w)))], [B_w @ C, A_w]])
    G = np.zeros((len(A), len(sigma)))
    G[n_p : n_p + len(filter_.F)] = filter_.L * sigma
    P = solve_discrete_lyapunov(A, G @ G.T)
    c = np.hstack([D_w @ C, C_w])
    squares = np.einsum("ij,jk,ik->i", c, P, c)
    return np.asarray(np.sqrt(np.maximum(squares, 0.0)))  # where nothing moves rounding is on either side
