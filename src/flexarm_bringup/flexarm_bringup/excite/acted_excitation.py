"""Which excitation acted in every period: that of the command whose torque acted.

A command that comes too late for its period acts in the next one, or a later one drives over it. What excited
the arm is then not what was asked of that instant, and an instrument that says so has little to do with the
arm's motion. Torques of commands go through the guard unchanged, so the torque that acted names its command.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
OLDEST = 10  # periods; older commands the guard does not use
SAME = 1e-9  # N m or N between torques that are one


def acted_excitation(acted: Array, commanded: Array, added: Array) -> Array:
    """Return the part of the torque that excited, (n, n_theta) [N m or N].

    Args:
        acted: Torque of the drives in every period, (n, n_theta).
        commanded: Torque of the command that was made for it, (n, n_theta).
        added: The part of it that excites, (n, n_theta).

    Where the guard changed a torque, that of the period's own command stays.
    """
    found = added.copy()
    open_ = np.ones(len(acted), bool)
    for late in range(OLDEST + 1):
        n = len(acted) - late
        if n <= 0:
            break
        is_it = open_[late:] & (abs(acted[late:] - commanded[:n]) <= SAME).all(axis=1)
        found[late:][is_it] = added[:n][is_it]
        open_[late:] &= ~is_it
    return found
