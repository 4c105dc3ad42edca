"""Programs in stages, solved by HPIPM: the data stay the caller's arrays and are read anew at every solve.

Minimise over ``u_k``, ``x_k`` and slacks ``s >= 0``::

    sum_k  x' Q x / 2 + u' S x + u' R u / 2 + q' x + r' u + z' s + s' Z s / 2
    x_{k+1} = A x_k + B u_k + b          l - s_l <= C x_k + D u_k <= u + s_u       k = 0 ... N

Only rows in ``soft`` have slacks, one downwards and one upwards each. The first stage may have no states
(then ``b`` carries the known ones), the last one has no inputs as a rule. There are two stages at least.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.solvers.hpipm_library import PREFIX, HpipmObject, load_hpipm, set_option

Array = NDArray[np.float64]
BALANCED = 2  # HPIPM's mode: relative formulation, square-root Riccati recursion
STATUS = ("solved", "iteration limit", "step too short", "not a number", "equations contradict each other")
OPEN = 1e10  # stands for an infinite bound; it is masked
MATRICES = ("A", "B", "b", "Q", "S", "R", "q", "r")  # in the order of HPIPM's setter
UNUSED_BOXES = 6  # bounds of single states and inputs: rows serve for them here


@dataclass(frozen=True)
class Stage:
    """Arrays of one stage, C-contiguous float64; change their numbers in place between solves.

    Attributes:
        Q, S, R: Curvature, (n_x, n_x), (n_u, n_x), (n_u, n_u).
        q, r: Gradient, (n_x,), (n_u,).
        A, B, b: To the next stage's states, (n_x+, n_x), (n_x+, n_u), (n_x+,); with no rows in the last one.
        C, D: Rows, (n_g, n_x), (n_g, n_u).
        l, u: Their bounds, (n_g,); which of them are infinite must not change.
        soft: Rows that may be left at a price, (n_s,).
        z, Z: That price, linear and quadratic, the same both ways, (n_s,).
    """

    Q: Array
    S: Array
    R: Array
    q: Array
    r: Array
    A: Array
    B: Array
    b: Array
    C: Array
    D: Array
    l: Array  # noqa: E741
    u: Array
    soft: NDArray[np.int32]
    z: Array
    Z: Array


@dataclass(frozen=True)
class StagesAnswer:
    """What HPIPM found.

    Attributes:
        u: Inputs of the stages.
        x: States of the stages.
        status: In words.
        iterations: Of the interior-point method [1].
        residual: Largest of stationarity, equations, rows and complementarity [1]; inf when not finite.
        solved: Whether status, finiteness and residual vouch for it.
    """

    u: tuple[Array, ...]
    x: tuple[Array, ...]
    status: str
    iterations: int
    residual: float
    solved: bool


class HpipmStages:
    """A program in stages with its workspace; made again after an answer that is not finite."""

    def __init__(self, stages: Sequence[Stage], tolerance: float, max_iterations: int) -> None:
        """Take the arrays of the stages, the tolerance of all residuals, and the cap."""
        self._stages, self._tolerance, self._max_iterations = tuple(stages), tolerance, max_iterations
        self._sizes = [(s.Q.shape[0], s.R.shape[0], s.l.size, s.soft.size) for s in self._stages]
        self._masks = [[np.isfinite(bound).astype(float) for bound in (s.l, s.u)] for s in self._stages]
        self._low, self._high = ([np.empty(s.l.size) for s in self._stages] for _ in range(2))
        self._x, self._u = ([np.empty(size[i]) for size in self._sizes] for i in (0, 1))
        self._tables = self._list_pointers()
        self._build()

    def solve(self) -> StagesAnswer:
        """Solve for the numbers that the arrays hold now. Never raises."""
        library = load_hpipm()
        for stage, low, high in zip(self._stages, self._low, self._high, strict=True):
            np.maximum(stage.l, -OPEN, out=low)
            np.minimum(stage.u, OPEN, out=high)
        library.d_ocp_qp_set_all_rowmaj(*self._tables, self._qp.pointer)
        library.d_ocp_qp_ipm_solve(
            self._qp.pointer, self._sol.pointer, self._options.pointer, self._workspace.pointer
        )
        for k, (x, u) in enumerate(zip(self._x_pointers, self._u_pointers, strict=True)):
            library.d_ocp_qp_sol_get_x(k, self._sol.pointer, x)
            library.d_ocp_qp_sol_get_u(k, self._sol.pointer, u)
        return self._judge()

    def _judge(self) -> StagesAnswer:
        status, iterations = self._read("status", ctypes.c_int()), self._read("iter", ctypes.c_int())
        kinds = ("stat", "eq", "ineq", "comp")
        residuals = [self._read(f"max_res_{kind}", ctypes.c_double()) for kind in kinds]
        residual = max(residuals) if np.isfinite(residuals).all() else np.inf
        is_finite = all(np.isfinite(part).all() for part in (*self._x, *self._u))
        x, u = (tuple(part.copy() for part in parts) for parts in (self._x, self._u))
        if not is_finite or not np.isfinite(residual):
            self._build()
            u, x = (tuple(np.zeros(part.size) for part in parts) for parts in (u, x))
        solved = is_finite and status == 0 and residual <= 10 * self._tolerance
        return StagesAnswer(u, x, STATUS[int(status)], int(iterations), residual, bool(solved))

    def _read(self, name: str, into: ctypes.c_int | ctypes.c_double) -> float:
        load_hpipm()[f"{PREFIX}_ipm_get_{name}"](self._workspace.pointer, ctypes.byref(into))
        return into.value

    def _build(self) -> None:
        library, last = load_hpipm(), len(self._stages) - 1
        self._dim = dim = HpipmObject("_dim", last)
        for k, sizes in enumerate(self._sizes):
            for name, size in zip(("nx", "nu", "ng", "ns"), sizes, strict=True):
                library[f"{PREFIX}_dim_set_{name}"](k, size, dim.pointer)
        self._qp = HpipmObject("", dim.pointer)
        self._sol = HpipmObject("_sol", dim.pointer)
        self._options = HpipmObject("_ipm_arg", dim.pointer)
        library.d_ocp_qp_ipm_arg_set_default(BALANCED, self._options.pointer)
        for name in ("tol_stat", "tol_eq", "tol_ineq", "tol_comp"):
            set_option(self._options, name, self._tolerance)
        set_option(self._options, "iter_max", self._max_iterations)
        self._workspace = HpipmObject("_ipm_ws", dim.pointer, self._options.pointer)
        for k, masks in enumerate(self._masks):
            for name, mask in zip(("lg", "ug"), masks, strict=True):
                library[f"{PREFIX}_set_{name}_mask"](k, _pointer(mask), self._qp.pointer)
        self._x_pointers, self._u_pointers = ([_pointer(part) for part in p] for p in (self._x, self._u))

    def _list_pointers(self) -> tuple[ctypes.Array[ctypes.c_void_p] | None, ...]:
        """Return tables of pointers to the stages' arrays, in the order of HPIPM's setter."""
        stages = self._stages
        zeros = self._zeros = [np.zeros(stage.soft.size) for stage in stages]
        tables = [_table([getattr(stage, name) for stage in stages]) for name in MATRICES]
        rows = [_table(parts) for parts in ([s.C for s in stages], [s.D for s in stages])]
        bounds = [_table(self._low), _table(self._high)]
        prices = [_table([getattr(stage, name) for stage in stages]) for name in ("Z", "Z", "z", "z")]
        soft = [_table([stage.soft for stage in stages]), None, _table(zeros), _table(zeros)]
        return (*tables, *[None] * UNUSED_BOXES, *rows, *bounds, *prices, *soft)


def _pointer(array: NDArray[np.generic]) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data)


def _table(arrays: Sequence[NDArray[np.generic]]) -> ctypes.Array[ctypes.c_void_p]:
    """Return a table of pointers.

    Raises:
        ValueError: An array would have to be copied, so that later changes of it would not be seen.
    """
    for array in arrays:
        if array.dtype not in (np.float64, np.int32) or not array.flags.c_contiguous:
            raise ValueError(f"stage: an array of {array.dtype}, {array.shape} is not contiguous float64")
    return (ctypes.c_void_p * len(arrays))(*[array.ctypes.data for array in arrays])
