"""What the axes of the rig are told, checked before it moves: a NaN that it took would stay for ever."""

from __future__ import annotations

from collections.abc import Collection
from math import isfinite

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def check_axis_values(name: str, values: ArrayLike, axes: Collection[str]) -> Array:
    """Return values of any unit as an array, (n_theta,).

    Args:
        name: Of what they are.
        values: One per axis, (n_theta,).
        axes: Actuated axes, "joint.axis".

    Raises:
        ValueError: They are not one finite number per axis.
    """
    array = np.asarray(values, float)
    if array.shape != (len(axes),) or not all(map(isfinite, array.tolist())):  # of so few, soonest so
        raise ValueError(
            f"{name} is {array}; expected a list of one finite number per axis: {', '.join(axes)}"
        )
    return array
