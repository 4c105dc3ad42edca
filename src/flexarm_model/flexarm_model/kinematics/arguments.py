"""What is handed to kinematics, checked: so many finite numbers, a sign."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexarm_model.kinematics.refusals import KinematicsError

Array = NDArray[np.float64]


def finite(name: str, values: ArrayLike, count: int) -> Array:
    """Return values of any unit as an array, (count,).

    Raises:
        KinematicsError: They are not so many finite numbers.
    """
    array = np.asarray(values, dtype=float)
    if array.shape != (count,) or not np.isfinite(array).all():
        raise KinematicsError(f"{name} is {array}; expected {count} finite numbers")
    return array


def check_sign(name: str, value: int) -> None:
    """Refuse what is neither 1 nor -1.

    Raises:
        KinematicsError: It is something else.
    """
    if value not in (1, -1):
        raise KinematicsError(f"{name} is {value}; expected 1 or -1")
