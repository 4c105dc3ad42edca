"""What a served model leaves out of the arm's motion: what the corrected filter needs once for every step."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filters.flow import NoFlow, StateFlow
from flexarm_estimator.state.process import Transition
from flexarm_estimator.steps.bilinear import Bilinear, value

Array = NDArray[np.float64]


class Reach(NamedTuple):
    """How far the mean may be from rest; beyond it has been led astray.

    Attributes:
        places: In the state, (k,).
        most: How far each may be, (k,).
    """

    places: NDArray[np.intp]
    most: Array


class LeftOut(ABC):
    """Works out the inputs of a corrected step."""

    @abstractmethod
    def at(self, x: Array, step: Transition, u: Array) -> Array:
        """Return ``[a; r; tau; 1]`` at the end of a step, (n + n_y + n_u + 1,).

        Where the motion cannot be computed, or the mean is beyond its reach, nothing is left out: zeros.

        Args:
            x: State before the step, (n_x,).
            step: Of the served model.
            u: ``[tau; 1]``, (n_u + 1,).
        """


class PlainLeftOut(LeftOut):
    """With NumPy."""

    def __init__(self, flow: StateFlow, served: Bilinear, reach: Reach) -> None:
        """Take the motion, ``[xi''; y]`` as the model serves them, and how far the mean may be."""
        self._flow, self._served, self._reach = flow, served, reach
        self._nothing = np.zeros(len(served.of_x))

    def at(self, x: Array, step: Transition, u: Array) -> Array:
        """See LeftOut."""
        x = value(step.A, step.B, step.slopes, (x, u))
        if (abs(x[self._reach.places]) > self._reach.most).any():
            return np.concatenate([self._nothing, u])
        try:
            moved = np.concatenate(self._flow.acceleration_and_rows(x, u))
        except NoFlow:
            return np.concatenate([self._nothing, u])
        left_out = moved - value(*self._served, (x, u))
        return np.concatenate([left_out if np.isfinite(left_out).all() else self._nothing, u])
