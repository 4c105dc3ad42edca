"""Constraint rows of the joints that close loops: six per closure, zero where its two frames are one.

With the node's position and rotation seen from the end of the joint's axes, turned by the angle a about n::

    c = [p; sin(a) n]        far away: [p; 2 sin(a/2) n]

The first is what the equations of motion use; it vanishes at a = 180 degrees, too, where a loop is closed
upside down. The second vanishes at a = 0 alone and serves to close a loop from far away.
"""

from __future__ import annotations

from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from flexarm_model.tree.frame_graph import Closure
from flexarm_model.tree.frames import Motion

Array = NDArray[np.float64]

UPSIDE_DOWN = 1e-9  # of the half angle's squared cosine: at 180 degrees the direction of the turn is lost


class ClosureRows:
    """The rows over the coordinates.

    Attributes:
        residual: Displacement [m] and sine of the turn [1] of every closure's node, (6 n_closures,).
        names: Names of the joints that close the loops.
    """

    def __init__(self, closures: tuple[Closure, ...], motions: dict[int, Motion], q: ca.SX) -> None:
        """Write the rows down.

        Args:
            closures: Pairs of frames that joints make one.
            motions: Of all frames.
            q: All coordinates, (n_q,).
        """
        self.names = tuple(closure.name for closure in closures)
        self._q = q
        pairs = [(motions[closure.end], motions[closure.node]) for closure in closures]
        self._shifts = [end.R.T @ (node.p - end.p) for end, node in pairs]
        turns = [end.R.T @ node.R for end, node in pairs]
        self._sines = [
            ca.vertcat(turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]) / 2
            for turn in turns
        ]
        self._cosines = [(ca.trace(turn) - 1) / 2 for turn in turns]
        self.residual = self._stack(self._sines)
        self._near = self._with_jacobian(self.residual)

    def near(self, q: Array) -> tuple[Array, Array]:
        """Return the rows (m,) and their Jacobian (m, n_q), kept."""
        c, G = self._near(q)
        return np.array(c).ravel(), np.array(G)

    def far(self, q: Array) -> tuple[Array, Array]:
        """Return the same of the rows that serve far away, (m,) and (m, n_q)."""
        c, G = self._far(q)
        return np.array(c).ravel(), np.array(G)

    def upside_down(self, q: Array) -> tuple[str, ...]:
        """Return the names of the closures whose node is turned by more than 90 degrees at q, (n_q,)."""
        cosines = np.array(self._angles(q)).ravel()
        return tuple(name for name, cosine in zip(self.names, cosines, strict=True) if cosine < 0)

    def gaps(self, q: Array) -> dict[str, tuple[float, float]]:
        """Return by how much every closure is open at q (n_q,), by name: distance [m] and turn [rad]."""
        rows, cosines = self.near(q)[0].reshape(-1, 6), np.array(self._angles(q)).ravel()
        shifts, sines = (np.linalg.norm(part, axis=1) for part in (rows[:, :3], rows[:, 3:]))
        turns = np.arctan2(sines, cosines)
        return dict(zip(self.names, zip(shifts.tolist(), turns.tolist(), strict=True), strict=True))

    @cached_property
    def _angles(self) -> ca.Function:
        return ca.Function("cosines", [self._q], [ca.vertcat(ca.SX(0, 1), *self._cosines)])

    @cached_property
    def _far(self) -> ca.Function:
        halves = [ca.sqrt(ca.fmax((1 + cosine) / 2, UPSIDE_DOWN)) for cosine in self._cosines]
        turns = [sine / half for sine, half in zip(self._sines, halves, strict=True)]
        return self._with_jacobian(self._stack(turns))

    def _stack(self, turns: list[ca.SX]) -> ca.SX:
        rows = [ca.vertcat(*pair) for pair in zip(self._shifts, turns, strict=True)]
        return ca.vertcat(*rows) if rows else ca.SX(0, 1)

    def _with_jacobian(self, rows: ca.SX) -> ca.Function:
        return ca.Function("rows", [self._q], [rows, ca.jacobian(rows, self._q)])
