"""The closed loop of arm, sensors, filter and law as one matrix, period by period.

State ``z = [x_p; x_f; w]``: full plant, filter after the sample of the instant, torques on their way (the
oldest acts next; without a delay, the last one). With the plant's modal forces ``f = b u``::

    x_p+ = A x_p + B f      y+ = C x_p+ + E f      x_f+ = F x_f + G u + L y+
    u = w_oldest      w+ = [... ; K_f x_f + K_w w]

The filter is told the torque that was sent; what the arm gets may be more, less or later.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.margins.full_plant import FullPlant
from flexarm_controller.margins.law_gain import LawGain
from flexarm_model.served.steady_filter import SteadyFilter

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ClosedLoop:
    """``z+ = A z`` and where the forces on the modes enter it.

    Attributes:
        A: (n_z, n_z).
        torque: Torque that acts now, of z, (n_u, n_z).
        plant: The plant in it, the first part of z.
        enter: Change of z+ by a force held over the period, per mode, (n_z, n).
        early: The part of it that is due to the first k parts of the period, (PARTS + 1, n_z, n).
    """

    A: Array
    torque: Array
    plant: FullPlant
    enter: Array
    early: Array


def close_loop(plant: FullPlant, filter_: SteadyFilter, law: LawGain, delay: int) -> ClosedLoop:
    """Put the loop together.

    Args:
        plant: The arm with more modes than the filter knows; its rows are the filter's.
        filter_: Settled filter.
        law: Linear law on the filter's state.
        delay: Periods between a state and the torque computed from it.
    """
    n_p, n_f, n_u = len(plant.A), len(filter_.F), plant.b.shape[1]
    n_w = max(delay, 1) * n_u
    p, f = slice(0, n_p), slice(n_p, n_p + n_f)
    first, last = n_p + n_f, n_p + n_f + n_w
    command = np.zeros((n_u, last))
    n_x = law.x.shape[1]
    command[:, n_p : n_p + n_x], command[:, n_p + n_x : n_p + n_x + n_u] = law.x, law.d
    command[:, first:] = law.sent
    torque = np.eye(last)[first : first + n_u] if delay else command
    A = np.zeros((last, last))
    A[p, p], A[f, f], A[f, p] = plant.A, filter_.F, filter_.L @ plant.C @ plant.A
    A[first : last - n_u, first + n_u :] = np.eye(n_w - n_u)
    A[last - n_u :] = command
    A[f] += filter_.G @ torque
    into = np.vstack([np.eye(n_p), filter_.L @ plant.C, np.zeros((n_w, n_p))])  # of a change of x_p+
    felt = np.zeros((last, plant.E.shape[1]))
    felt[f] = filter_.L @ plant.E
    enter = into @ plant.force + felt
    A += enter @ plant.b @ torque
    return ClosedLoop(A, torque, plant, enter, into @ plant.early)
