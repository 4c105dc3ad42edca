"""A Kalman filter that has settled, as matrices: what whoever closes the loop must know of an estimator.

    x+ = F x + G tau + L y          tau: held over the period that ends with y

``x`` is the estimate after the sample of its instant; it starts with ``[theta; eta; theta'; eta'; d]`` of the
served model. Constant parts (operating point, offsets) are left out: they move nothing but the point of rest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.modal.read_only import lock_arrays

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SteadyFilter:
    """Matrices of the module's equation.

    Attributes:
        model_id: Served model that it belongs to.
        dt: Its period [s].
        rows: Output rows "sensor.channel" that it fuses, (n_y,).
        left_out: Sensors that it does not, for they are late or slower than the period.
        F: (n_x, n_x).
        G: (n_x, n_u).
        L: (n_x, n_y).
    """

    model_id: str
    dt: float
    rows: tuple[str, ...]
    left_out: tuple[str, ...]
    F: Array
    G: Array
    L: Array

    def __post_init__(self) -> None:
        """Check the shapes and make the arrays read-only.

        Raises:
            ValueError: They do not fit each other.
        """
        n_x = len(self.F)
        if self.F.shape != (n_x, n_x) or self.G.shape[:1] != (n_x,) or self.L.shape != (n_x, len(self.rows)):
            raise ValueError(f"filter: F {self.F.shape}, G {self.G.shape}, L {self.L.shape} do not fit")
        lock_arrays(self)
