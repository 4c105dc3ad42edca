"""Modes as they were measured, to fit a description to."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from flexarm_model.modal.read_only import lock_arrays

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ModeTable:
    """Modes measured at one pose; nan where a number is not known.

    Attributes:
        pose: Actuated axes [rad] or [m], (n_theta,).
        f_hz: Natural frequencies, matched to the model's modes in this order [Hz], (r,).
        f_std_hz: One sigma of them [Hz], (r,).
        zeta: Damping ratios [1], (r,).
        zeta_std: One sigma of them [1], (r,).
        shapes: At the sensors, in units of ``size``, of length one [1], (r, n_out).
        size: Of every sensor's part in the modes, (n_out,).
    """

    pose: Array
    f_hz: Array
    f_std_hz: Array
    zeta: Array
    zeta_std: Array
    shapes: Array = field(default_factory=lambda: np.zeros((0, 0)))
    size: Array = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        lock_arrays(self)
