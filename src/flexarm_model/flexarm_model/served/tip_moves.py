"""By how much each mode moves the tip, and where that is rounding."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]

UNMOVED = 1e-6  # of the tip's largest displacement in any coordinate of unit mass: less is rounding
HEAVIEST = 1e6  # kg; no arm is heavier, so its tip moves by 1e-3 kg^-0.5 at least where it moves at all


def tip_moves(model: ReducedModel) -> Array:
    """Return by how much each mode moves the tip [kg^-0.5], (n_eta,); exactly 0 where that is rounding.

    A tip on a hub or on a guided slider is moved by the axes alone. What the numbers then leave there is
    compared with what the tip does in any coordinate, axes included, each scaled to unit mass.
    """
    column = np.linalg.norm(model.outputs.C_pos[model.outputs.rows("tip")[:3]], axis=0)
    largest = max((column / np.sqrt(np.diag(model.M))).max(), 1.0 / np.sqrt(HEAVIEST))
    moved = column[model.n_theta :]
    return np.where(moved > UNMOVED * largest, moved, 0.0)
