"""What the rules of retuning ask of an arm: its served modes as the tip feels them.

The stiffness of a mode at the tip is the force that holds the tip out by a metre in that mode's shape alone,
``k = omega^2 / |phi_tip|^2`` (modes have unit mass), so ``k a^2 / 2`` is the energy of an amplitude a there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.modal.read_only import lock_arrays
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.served.tip_moves import tip_moves

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ArmFacts:
    """Served modes with the axes held, slowest first.

    Attributes:
        f_hz: Frequencies [Hz], (n_eta,).
        zeta: Damping ratios [1], (n_eta,).
        tip_stiffness: At the tip; infinite for a mode that does not move it [N/m], (n_eta,).
    """

    f_hz: Array
    zeta: Array
    tip_stiffness: Array

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        lock_arrays(self)


def read_facts(model: ReducedModel) -> ArmFacts:
    """Return the facts of a served model."""
    moved = tip_moves(model)
    felt = moved > 0.0
    stiffness = np.where(felt, model.omega**2 / np.where(felt, moved, 1.0) ** 2, np.inf)
    return ArmFacts(model.omega / (2 * np.pi), model.zeta.copy(), stiffness)
