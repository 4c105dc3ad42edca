"""Where the axes are to rest when the modes rest elsewhere than the model says.

A payload or a stiffness that is not as described bends the arm by ``s`` [kg^0.5 m] more than its model
knows. Vibration is counted from there, ``eta - s``, so the axes come to rest on their reference all the same.
Where the tip's pose costs something its static error is weighed against that of the axes, once and for all::

    delta = argmin delta' W_theta delta + (J delta + C_s s)' W_t (J delta + C_s s) = shift s

and the equilibrium of the reference becomes that of ``theta_r + delta``: the tip rests where it should, as
far as its weight says.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.program.cost import Cost
from flexarm_controller.program.equilibrium import Equilibrium

Array = NDArray[np.float64]


def rest_shift(cost: Cost, rest: Equilibrium) -> Array:
    """Return what every axis is to move by per static deflection of every mode, (n_theta, n_eta)."""
    m, n = len(rest.u_0), len(rest.x_0) // 2
    J, C_s = cost.tip @ rest.X_rest[:, :m], cost.tip[:, m:n]
    if not cost.tip_weight.size:
        return np.zeros((m, n - m))
    weighted = J.T * cost.tip_weight
    return np.asarray(-np.linalg.solve(cost.Q[:m, :m] + weighted @ J, weighted @ C_s))
