"""What the corrected, extended and unscented filters ask of the arm beyond its tip: a reduced tree has it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.tool.tip import Kinematics

Array = NDArray[np.float64]


class ClosedLoops(Protocol):
    """Which coordinates follow the others where loops close."""

    @property
    def dependent(self) -> NDArray[np.intp]:
        """Indices in q, (n_c,)."""
        ...


@runtime_checkable
class Dynamics(Kinematics, Protocol):
    """Equation of motion in tree coordinates, ``M(q) v' + h(q, v) + G' lambda = f`` and ``c(q) = 0``.

    ``expressions`` holds "inverse_dynamics" (q, v, a), "outputs" (q, v, a, q_ref) and, with loops,
    "constraints" (q) as CasADi functions; ``functions`` holds "motion" (q, v), which gives M and h.
    """

    @property
    def n_q(self) -> int:
        """Number of coordinates."""
        ...

    @property
    def n_c(self) -> int:
        """Number of rows that close the loops."""
        ...

    @property
    def loops(self) -> ClosedLoops:
        """How the loops close."""
        ...

    @property
    def expressions(self) -> Mapping[str, ca.Function]:
        """Symbolic functions by name."""
        ...

    @property
    def functions(self) -> Mapping[str, Any]:
        """The same, ready to be called with arrays."""
        ...

    def closed(self, q: Array) -> Array:
        """Return q with the loops closed, (n_q,)."""
        ...

    def constraints(self, q: Array) -> tuple[Array, Array]:
        """Return the rows that close the loops and their Jacobian, (n_c,) and (n_c, n_q)."""
        ...
