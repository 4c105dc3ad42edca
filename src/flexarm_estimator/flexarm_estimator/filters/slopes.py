"""Derivatives of the moving arm along given directions, by algorithmic differentiation of its compiled model.

With ``r(q, v, a, lambda) = inverse dynamics + G(q)' lambda``, sensor rows ``y(q, v, a)``, the loops' velocity
``s = G v`` and acceleration ``g = G a + G_dot v``, along directions ``(S_q, S_v)`` of q and v at once::

    dr = r_q S_q + r_v S_v      dy = y_q S_q + y_v S_v      ds = s_q S_q      dg = g_q S_q + g_v S_v

One direction is compiled and run in a loop: the Jacobian of 84 coordinates written out makes 15 MB of C.
"""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filters.dynamics import Dynamics
from flexarm_model.numeric.compiled import FastFunction, FunctionTable

Array = NDArray[np.float64]


class Slopes:
    """Rows of the sensors and derivatives of one arm, for any served model of it.

    Attributes:
        functions: "rows" (q, v, a), "rows_a" (q) and, with loops, "drift" (q, v), ready to be called.
    """

    def __init__(self, tree: Dynamics, rows: Sequence[int], use_compiler: bool = True) -> None:
        """Write the functions; they are compiled when first needed.

        Args:
            tree: The arm.
            rows: Output rows of the sensors that are rows.
            use_compiler: False evaluates on CasADi's virtual machine.
        """
        self._use_compiler = use_compiler
        q, v, a = (ca.SX.sym(name, tree.n_q) for name in "qva")
        force = ca.SX.sym("lambda", tree.n_c)
        residual = tree.expressions["inverse_dynamics"](q, v, a)
        y = tree.expressions["outputs"](q, v, a, ca.SX.zeros(tree.n_q))[list(rows)]
        values = {"rows": ([q, v, a], y), "rows_a": ([q], ca.jacobian(y, a))}
        self._along: dict[str, ca.Function] = {}
        if tree.n_c:
            c = tree.expressions["constraints"](q)[0]
            residual += ca.jtimes(c, q, force, True)
            speed = ca.jtimes(c, q, v)
            drift = ca.jtimes(speed, q, v)
            values["drift"] = [q, v], drift
            self._along["speed"] = _along("speed", [q, v], [speed])
            self._along["turn"] = _along("turn", [q, v, a], [drift + ca.jtimes(c, q, a)])
        self._along["bend"] = _along("bend", [q, v, a, force], [residual, y])
        functions = {name: ca.Function(name, at, [value]) for name, (at, value) in values.items()}
        self.functions = FunctionTable(functions, use_compiler)
        self._mapped: dict[str, FastFunction] = {}

    def rows(self, q: Array, v: Array, a: Array) -> Array:
        """Return the sensors' rows, (n_y,)."""
        return np.array(self.functions["rows"](q, v, a)).ravel()

    def rows_by_acceleration(self, q: Array) -> Array:
        """Return their derivative by a, (n_y, n_q)."""
        return np.array(self.functions["rows_a"](q)).reshape(-1, q.size)

    def drift(self, q: Array, v: Array) -> Array:
        """Return ``G_dot v``, the loops' acceleration where a = 0, (n_c,)."""
        return np.array(self.functions["drift"](q, v)).ravel()

    def along(self, name: str, point: Sequence[Array], S_q: Array, S_v: Array) -> list[Array]:
        """Return derivatives along k directions, with k columns each.

        Args:
            name: "bend" gives [dr, dy], "speed" [ds], "turn" [dg].
            point: (q, v, a, lambda), (q, v), (q, v, a).
            S_q: Directions of the positions, (n_q, k).
            S_v: Of the velocities, (n_q, k).
        """
        count = S_q.shape[1]
        key = f"{name}_{count}"
        if key not in self._mapped:
            fixed = list(range(len(point)))
            mapped = self._along[name].map(key, "serial", count, fixed, [])
            self._mapped[key] = FunctionTable({key: mapped}, self._use_compiler)[key]
        result = self._mapped[key](*point, S_q, S_v)
        return [np.array(part).reshape(-1, count) for part in (result if name == "bend" else (result,))]


def _along(name: str, point: list[ca.SX], values: list[ca.SX]) -> ca.Function:
    """Return the derivatives of ``values`` along one direction of q and v, which come first in ``point``."""
    q, v = point[:2]
    S_q, S_v = (ca.SX.sym(part, q.numel()) for part in ("S_q", "S_v"))
    slopes = [ca.jtimes(value, q, S_q) + ca.jtimes(value, v, S_v) for value in values]
    return ca.Function(name, [*point, S_q, S_v], slopes)
