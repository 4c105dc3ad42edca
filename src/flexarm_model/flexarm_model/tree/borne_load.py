"""What an arm bears at rest, and where as much again would bring it.

An arm that is heavier or softer than described by a share sags further by that share of what it bears. A
served model that keeps the slowest modes shows most of it at the tip, but not what the gauges say: of what a
gauge of a six-axis arm says at rest, modes that are not served make six hundredths. With ``Z`` the motions
that the loops leave while the motors hold, K with the load's own stiffness::

    dq = Z (Z' K Z)^-1 Z' f        dy = dy/dq dq
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class BorneLoad(NamedTuple):
    """What springs and bodies bear at a pose.

    Attributes:
        force: With which they bear being bent, (n_q,).
        outputs: How much further all outputs would be under as much again, SI, (n_y,).
    """

    force: Array
    outputs: Array


def borne_load(force: Array, K: Array, Z: Array, outputs: Array) -> BorneLoad:
    """Return the load of an arm at rest.

    Args:
        force: With which springs and bodies bear being bent, (n_q,).
        K: Stiffness there, (n_q, n_q).
        Z: Motions with the motors held, (n_q, n_z).
        outputs: Derivative of the outputs by q, (n_y, n_q).
    """
    dq = Z @ np.linalg.solve(Z.T @ K @ Z, Z.T @ force)
    return BorneLoad(force, np.asarray(outputs @ dq))
