"""The one interface of all filters: where the matrices of a step come from.

Every filter is the same machine: joint step, gate, rewinding, filterpy beside it. They differ in the linear
stand-in for one step, ``x+ = A x + B u + w``, ``y = C x+ + D u + D_w f + v``, and in nothing else:

* linear: the served model's, whatever the belief (``served.ServedSteps``);
* extended: tangents of the arm's motion at the belief's mean (``tangent.TangentSteps``);
* corrected: the served model's, what the arm's motion adds to it being an input (``corrected``);
* unscented: regression over sigma points of the belief, whose residual joins the noise
  (``sigma.SigmaSteps``).

The last column of ``B`` and ``D`` (``u`` ends with 1) holds what makes the stand-in exact at the mean.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filter import Belief
from flexarm_estimator.state.process import Transition
from flexarm_estimator.state.sensors import MeasurementModel
from flexarm_estimator.steps.stack import Stack

Array = NDArray[np.float64]


class Look(NamedTuple):
    """A pose sample as the filter sees it.

    Attributes:
        nu: Innovation, (m,).
        H: Jacobian, (m, n_x).
        spread: Joins the noise: how far the sensor is from linear within the belief, (m, m) or 0.
    """

    nu: Array
    H: Array
    spread: Array | float = 0.0


class StepSource(ABC):
    """Makes linear stand-ins for one served model; ``u = [tau; 1]``, (n_tau + 1,), is held over a step.

    Attributes:
        is_constant: They do not depend on the belief, so that a step made once may be run again.
        keeps_matrices: Only the inputs depend on it.
        dependent: Tree coordinates that follow the others where loops close; None when the state is only
            known about the static shape of its model, and that shape is the model's.
    """

    is_constant: bool
    keeps_matrices: bool
    dependent: Sequence[int] | None

    def inputs(self, before: Belief, dt: float, u: Array) -> Array:
        """Return the inputs of that step, which end with ``u``, (n_u + 1,); never raises."""
        return u

    @abstractmethod
    def transition(self, before: Belief, dt: float, u: Array) -> Transition:
        """Return the step from ``before`` over ``dt`` > 0 seconds under its ``inputs``; never raises."""

    @abstractmethod
    def rows(self, names: tuple[str, ...], prior: Belief, u: Array) -> Stack:
        """Return the rows of some sensors at the end of a step, about ``prior``; never raises."""

    @abstractmethod
    def look(self, model: MeasurementModel, y: Array, belief: Belief, u: Array) -> Look:
        """Return what a pose sensor's sample ``y``, (m,), says about the belief."""
