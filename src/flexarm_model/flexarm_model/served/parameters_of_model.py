"""Of which values of an arm's named parameters is a served model? A pressure that had changed, say.

A model does not name them. Its frequencies do: the values are those with which the arm has them at the pose
of the model.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import scipy
from numpy.typing import NDArray

from flexarm_model.manipulator.other_parameters import parameter_range
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
SAME = 1e-9  # of a frequency: what another order of sums does


def parameters_of(
    tree: ReducedTree, pose: Array, omega: Array, guess: Mapping[str, float]
) -> dict[str, float]:
    """Return the values [SI] with which the arm comes nearest to the frequencies of a model.

    Args:
        tree: The arm as described.
        pose: Of the model, actuated axes [rad or m], (n_theta,).
        omega: Its frequencies [rad/s], (n_eta,).
        guess: Values to begin with, those of the model before it, say; kept where they will do.

    Raises:
        PoseError, ClosureError: The arm has no model at this pose.
    """
    names = sorted({law.parameter for law in tree.config.laws})
    if not names or not omega.size:
        return dict(guess)
    low, high = np.array([parameter_range(tree.config, name) for name in names]).T

    def off(shares: Array) -> Array:
        """Return how far the frequencies are off, relative, for values as shares of their ranges."""
        values = dict(zip(names, (low + shares * (high - low)).tolist(), strict=True))
        return np.asarray(linearize(tree.under(values), pose, omega.size).omega / omega - 1.0)

    known = {**tree.config.parameters, **guess}
    start = (np.array([known[name] for name in names]) - low) / (high - low)
    if abs(off(start)).max() <= SAME:
        return dict(guess)
    inside = start.clip(1e-6, 1.0 - 1e-6)  # the search wants to begin within its bounds
    found = scipy.optimize.least_squares(off, inside, bounds=(0.0, 1.0), xtol=1e-15, ftol=1e-15, gtol=1e-15).x
    return {**guess, **dict(zip(names, (low + found * (high - low)).tolist(), strict=True))}
