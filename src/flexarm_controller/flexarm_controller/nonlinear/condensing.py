"""The program of the horizon in its torques alone.

States follow the linearised periods ``s_{k+1} = A_k s_k + B_k (u_k + d) + r_k``; the cost is that of
``program.cost`` with the weights of this step's coordinates::

    sum dx' Q dx + du' R du + (u_j - u_{j-1})' S (u_j - u_{j-1}) + a_N' P a_N

What depends on the periods alone (Hessian, rows of the outputs) is made before the state is known:
``G_{k+1} = A_k G_k + B_k`` forwards, ``W_k = Q G_k + A_k' W_{k+1}`` backwards, of which ``B_k' W_{k+1}`` are
the rows of the Hessian [Frison2016]. The gradient needs two sweeps over vectors and comes with the state.
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.nonlinear.arm_equations import NonlinearModelError
from flexarm_controller.nonlinear.gauss_steps import Periods, Points, address, places
from flexarm_controller.nonlinear.goal_window import GoalWindow
from flexarm_controller.nonlinear.weights import Weights
from flexarm_model.numeric.machine_code import load_code

Array = NDArray[np.float64]
SOURCE = Path(__file__).with_name("condensing.c")


class _Layout(ctypes.Structure):
    """``struct horizon`` of the C file."""

    _fields_ = [
        *((name, ctypes.c_int64) for name in ("n_x", "n_u", "N", "n_v", "n_s")),
        *(
            (name, ctypes.c_void_p)
            for name in ("block", "unit", "Q", "P", "C", "R", "S", "A", "B", "r", "G", "W")
        ),
    ]


@dataclass(frozen=True)
class Known:
    """What a step begins with.

    Attributes:
        s_0: First state, (n_x,).
        d: Unmodelled torque, (n_u,).
        before: Torque before, (n_u,).
        shift: Of the goal's state and torque where the arm rests elsewhere than its model says, (n_x + n_u,).
    """

    s_0: Array
    d: Array
    before: Array
    shift: Array


class Condensing:
    """Programs of one horizon with one set of weights; the arrays are filled anew for every program.

    Attributes:
        H: Hessian, (n_v, n_v).
        q: Gradient, (n_v,).
        rows: Outputs at the ends of the blocks per torque, (n_b n_o, n_v).
        outputs: The same outputs without torques, (n_b n_o,).
        weight: Scale of the cost; one over the mean curvature of the torques at the first program.
    """

    def __init__(self, weights: Weights, blocks: tuple[int, ...], unit: Array, periods: Periods) -> None:
        """Lay out the program; torques are in the unit (n_u,) and held over blocks of periods.

        Raises:
            NonlinearModelError: There is no working C compiler.
        """
        code = load_code(SOURCE)
        if code is None:
            raise NonlinearModelError("law 'nmpc' needs a C compiler (gcc or cc), and there is none")
        N, n_x, n_u = periods.B.shape
        n_b, n_o = len(blocks), len(weights.names)
        n_v = n_b * n_u
        self._weights, self._n_x, self._N, self._code = weights, n_x, N, code
        self._block = np.repeat(np.arange(n_b), blocks)
        kept = (unit, weights.Q, weights.P, weights.C, weights.R, weights.S)
        self._kept = [np.ascontiguousarray(array, dtype=np.float64) for array in kept]
        self._room = np.zeros((N, n_x, n_v)), np.zeros(2 * n_x * max(n_v, 2) + n_u)
        self._periods = periods
        arrays = (*self._kept, periods.A, periods.B, periods.r, *self._room)
        self._layout = _Layout(n_x, n_u, N, n_v, n_o, int(self._block.ctypes.data), *map(address, arrays))
        self._at = ctypes.c_void_p(ctypes.addressof(self._layout))
        self.H, self.q, self.weight = np.zeros((n_v, n_v)), np.zeros(n_v), 1.0
        self.rows, self.outputs = np.zeros((n_b * n_o, n_v)), np.zeros(n_b * n_o)
        self._free, self._pull_s, self._pull_u = (
            np.zeros((N + 1, n_x)),
            np.zeros((N + 1, n_x)),
            np.zeros((N, n_u)),
        )
        self._v, self._known = np.zeros(n_v), (np.zeros(n_x), np.zeros(n_u), np.zeros(n_u))
        self._made = places(self.H, self.rows)
        into = (self._pull_s, self._pull_u, self._free, self.outputs, self.q)
        self._asked, self._answered = places(*self._known, *into), places(self._v, *self._known[1::-1])
        self._has_tip = bool(weights.tip.any())  # without it the goal is never shifted
        self._constant = self._of_torques(unit)
        for call in (code.flexarm_condense, code.flexarm_respond, code.flexarm_expand):
            call.restype = None

    def scale(self) -> None:
        """Choose the weight so that the mean curvature of the present program's torques is one."""
        self.weight = 1.0
        self.condense()
        self.weight = len(self.H) / float(np.trace(self.H))

    def condense(self) -> None:
        """Make ``H`` and ``rows`` of the linearised periods."""
        np.multiply(self._constant, self.weight, out=self.H)
        self._code.flexarm_condense(self._at, ctypes.c_double(self.weight), *self._made)

    def respond(self, known: Known, goal: GoalWindow) -> None:
        """Make ``q`` and ``outputs`` for what is known now."""
        w, n_x, P = self._weights, self._n_x, self._weights.P
        off = known.shift[:n_x]
        torque = goal.u + (known.shift[n_x:] - known.d)
        end = np.concatenate([goal.s[-1] + off, torque[-1]])
        np.matmul(goal.s, w.track, out=self._pull_s)
        if self._has_tip:
            self._pull_s += goal.at_rest @ w.tip + off @ w.Q
        self._pull_s[-1] = P[:n_x] @ end
        np.matmul(torque[:-1], w.R, out=self._pull_u)
        self._pull_u[-1] += P[n_x:] @ end
        self._take(known)
        self._code.flexarm_respond(self._at, ctypes.c_double(self.weight), *self._asked)

    def expand(self, v: Array, known: Known, points: Points, end: Array) -> None:
        """Move ``points`` to the solution v (n_v,); ``end`` (n_x,) becomes the state behind the horizon."""
        self._take(known)
        self._v[:] = v[: self._v.size]
        X = self._periods.places[0]
        self._code.flexarm_expand(self._at, *self._answered, X, *points.places, *places(end))

    def _take(self, known: Known) -> None:
        for mine, given in zip(self._known, (known.s_0, known.d, known.before), strict=True):
            mine[:] = given

    def _of_torques(self, unit: Array) -> Array:
        """Return the part of the Hessian that the torques' own costs make, (n_v, n_v)."""
        n_u, N, w = unit.size, self._N, self._weights
        T = np.kron(np.eye(self._block[-1] + 1)[self._block], np.diag(unit))  # (N n_u, n_v)
        step = T - np.vstack([np.zeros_like(T[:n_u]), T[:-n_u]])
        parts = [(T, np.kron(np.eye(N), w.R)), (step, np.kron(np.eye(N), w.S))]
        parts.append((T[-n_u:], w.P[self._n_x :, self._n_x :]))
        return np.asarray(sum(L.T @ weight @ L for L, weight in parts))
