"""By how much each mode moves the tip, and where that is rounding."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]

UNMOVED = 1e-6  # of the tip's largest displacement in any coordinate of unit mass: less is rounding
FELT = 0.1  # of the same: of modes that move the tip less, no error of the tip tells anything
LONGEST = 100.0  # m; no arm is longer, so a turn that moves nothing at the end of that moves nothing at all
HEAVIEST = 1e6  # kg; no arm is heavier, so its tip moves by 1e-3 kg^-0.5 at least where it moves at all


def tip_moves(model: ReducedModel) -> Array:
    """Return by how much each mode moves the tip [kg^-0.5], (n_eta,); exactly 0 where that is rounding.

    A tip on a hub or on a guided slider is moved by the axes alone. What the numbers then leave there is
    compared with what the tip does in any coordinate, axes included, each scaled to unit mass.
    """
    moved, largest = _moved(model)
    return np.where(moved > UNMOVED * largest, moved, 0.0)


def tip_turns(model: ReducedModel) -> Array:
    """Return by how much each mode turns the tip [rad m^-1 kg^-0.5], (n_eta,); 0 where that is rounding.

    As ``tip_moves`` of displacements: less than rounding of what turns the tip most, and of what moves it
    most, at the end of the longest lever. A slider turns by rounding in whatever moves it.
    """
    column = np.linalg.norm(model.outputs.C_pos[model.outputs.rows("tip")[3:]], axis=0)
    turned = float((column / np.sqrt(np.diag(model.M))).max())
    least = UNMOVED * max(turned, _moved(model)[1] / LONGEST)
    return np.where(column > least, column, 0.0)[model.n_theta :]


def are_felt(model: ReducedModel, count: int | None = None) -> bool:
    """Tell whether the tip feels modes: moved by one of them at least a tenth as far as by any coordinate.

    Hinged legs that bend between their hinges hardly move the platform that they carry. What is known of
    such a tip says nothing of its modes: a millimetre there would be metres in a leg.

    Args:
        model: The served model.
        count: Slowest modes that are asked about; None for all.
    """
    moved, largest = _moved(model)
    return bool(moved[:count].max(initial=0.0) > FELT * largest)


def _moved(model: ReducedModel) -> tuple[Array, float]:
    """Return how far each mode moves the tip, (n_eta,), and how far any coordinate of unit mass [kg^-0.5]."""
    column = np.linalg.norm(model.outputs.C_pos[model.outputs.rows("tip")[:3]], axis=0)
    largest = float((column / np.sqrt(np.diag(model.M))).max())
    return column[model.n_theta :], max(largest, 1.0 / np.sqrt(HEAVIEST))
