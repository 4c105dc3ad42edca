"""Advances an arm by implicit steps over a control period: in machine code, or with NumPy without a compiler.

Both give the same to rounding; ``implicit_steps`` has the equations.
"""

from __future__ import annotations

import ctypes
from abc import ABC, abstractmethod
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cython_blas, cython_lapack
from scipy.linalg.lapack import dgesv, dposv

from flexarm_bringup.sim.backlash import gaps_of
from flexarm_bringup.sim.friction import FRICTION_SLOPE, TANGENT, friction_over_step, tighten
from flexarm_bringup.sim.implicit_parts import EntriesLayout, find_parts
from flexarm_model.numeric.machine_code import MachineCode, load_code
from flexarm_model.tree.closing import MachineClosing, code_places
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
FAST = 0.5  # rad/s (m/s, or of what a coordinate is) from which steps of an open arm are corrected
SOURCE = Path(__file__).with_name("implicit_steps.c")


@dataclass(frozen=True)
class Stepping:
    """How a period is cut into steps.

    Attributes:
        h: Step [s].
        substeps: Steps per period.
        friction: Coulomb friction of the actuated axes [N m or N].
        is_driven: Torques on the actuated axes; False prescribes their acceleration.
        passes: Over each step; each takes everything where the one before leads.
    """

    h: float
    substeps: int
    friction: float
    is_driven: bool
    passes: int = 1


class Period(ABC):
    """One control period."""

    @abstractmethod
    def advance(self, q: Array, v: Array, u: Array) -> tuple[Array, Array, Array]:
        """Return q, v and the acceleration at the end, under torques or accelerations u (n_theta,)."""

    @abstractmethod
    def follow(self, tree: ReducedTree) -> None:
        """Let springs and dampers be those of the same tree under other parameters."""


class PlainPeriod(Period):
    """With NumPy."""

    def __init__(self, tree: ReducedTree, stepping: Stepping) -> None:
        """Prepare what stays the same from step to step."""
        self._stepping, n, m = stepping, tree.n_q, tree.n_c
        self.follow(tree)
        self._t = np.array(tree.actuated, dtype=int)
        self._free = np.setdiff1d(np.arange(n + m), [] if stepping.is_driven else self._t)
        self._gaps = gaps_of(tree)
        self._matrix, self._right = np.zeros((n + m, n + m), order="F"), np.zeros(n + m)
        self._grip = np.zeros(len(self._t), dtype=np.int64)

    def advance(self, q: Array, v: Array, u: Array) -> tuple[Array, Array, Array]:
        """See Period."""
        h, q, v = self._stepping.h, q.copy(), v.copy()
        dv = np.zeros_like(v)
        for _ in range(self._stepping.substeps):
            dv = np.zeros_like(v)
            self._grip[:] = TANGENT
            for _ in range(self._stepping.passes):
                dv = self._settled(q, v, dv, u)
            q += h * (v + dv / 2)
            v += dv
        if self._tree.n_c:
            q = self._tree.closing.close(q, v)
        return q, v, dv / h

    def follow(self, tree: ReducedTree) -> None:
        """See Period."""
        self._tree, h = tree, self._stepping.h
        self._constant = np.asfortranarray(h**2 / 4 * tree.K + h / 2 * tree.D)

    def _settled(self, q: Array, v: Array, guess: Array, u: Array) -> Array:
        """Return the change of velocity over one step in which friction pushes no axis, (n_q,)."""
        t, h, level = self._t, self._stepping.h, self._stepping.friction
        while True:
            dv, M, bias = self._change(q, v, guess, u)
            if not self._tree.n_c and abs(v).max() > FAST:
                missing = h * bias + M @ dv + self._constant @ (dv - guess)
                dv = self._corrected(q, v, dv, missing)
            if not (level and self._stepping.is_driven):
                return dv
            force, rise = friction_over_step(level, v[t], self._grip)
            if not tighten(self._grip, force, rise, v[t], dv[t]):
                return dv

    def _corrected(self, q: Array, v: Array, dv: Array, right: Array) -> Array:
        """Return a change of velocity with inertia and bias where it leads, (n_q,); see C."""
        mean, free, functions = v + dv / 2, self._free, self._tree.functions
        middle = q + self._stepping.h / 2 * mean
        right -= functions["mass_matrix"](middle) @ dv
        right -= self._stepping.h * functions["bias"](middle, mean)
        corrected = dv.copy()
        corrected[free] += self._solve(np.asfortranarray(self._matrix[np.ix_(free, free)]), right[free])
        return corrected

    def _change(self, q: Array, v: Array, guess: Array, u: Array) -> tuple[Array, Array, Array]:
        """Return the change of velocity, (n_q,), inertia, and bias, all functions where a guess leads."""
        tree, n, h, A, b = self._tree, self._tree.n_q, self._stepping.h, self._matrix, self._right
        mean = v + guess / 2
        middle = q + h / 2 * mean
        M, bias = tree.functions["mass_matrix"](middle), tree.functions["bias"](middle, mean)
        np.add(M, self._constant, out=A[:n, :n])
        np.subtract(self._constant @ guess, h * bias, out=b[:n])
        if tree.n_c:
            _, G = tree.functions["constraints"](middle)
            A[n:, :n], A[:n, n:] = G, G.T
            np.multiply(G @ v, -2.0, out=b[n:])
        t, change = self._t, np.zeros(n + tree.n_c)
        if self._stepping.is_driven:
            force, rise = friction_over_step(self._stepping.friction, v[t], self._grip)
            b[t] += h * (u - force)
            A[t, t] += h * rise
        else:
            change[t] = h * u
        if (gaps := self._gaps.index).size:
            force, stiffness, damping = self._gaps.released(middle[gaps], mean[gaps])
            bears = h**2 / 4 * stiffness + h / 2 * damping
            b[gaps] += h * force - bears * guess[gaps]
            A[gaps, gaps] -= bears
        free = self._free
        right = b[free] - A[np.ix_(free, t)] @ change[t]
        change[free] = self._solve(np.asfortranarray(A[np.ix_(free, free)]), right)
        return change[:n], M, bias

    def _solve(self, A: Array, b: Array) -> Array:
        """Return A^-1 b: positive definite without loops, indefinite with them."""
        return np.asarray(dgesv(A, b)[2] if self._tree.n_c else dposv(A, b)[1])


class _Layout(ctypes.Structure):
    """``struct period`` of the C file."""

    _fields_ = [
        *((name, ctypes.c_int64) for name in ("n", "m", "free", "heavy", "axes", "substeps", "passes")),
        *((name, ctypes.c_double) for name in ("h", "friction", "slope", "fast")),
        *((name, ctypes.c_void_p) for name in ("axis", "grip", "order", "constant")),
        ("gaps", ctypes.c_int64),
        *((name, ctypes.c_void_p) for name in ("gap", "half", "stiffness", "damping")),
        *((name, EntriesLayout) for name in ("inside", "across", "among", "led", "loop")),
        *((name, ctypes.c_void_p) for name in ("mass", "bias", "rows", "loops", "close")),
        *((name, ctypes.c_void_p) for name in ("dsyr2k", "dposv", "dpotrs", "work")),
    ]


class MachinePeriod(Period):
    """In machine code; with NumPy where that fails, which says why, and where parameters changed springs."""

    def __init__(self, tree: ReducedTree, stepping: Stepping, code: ctypes.PyDLL) -> None:
        """Bind the tree's functions, which are compiled."""
        self._plain, self._stepping = PlainPeriod(tree, stepping), stepping
        self._compiled, self._is_changed = tree, False
        n, m, t, h = tree.n_q, tree.n_c, tree.actuated, stepping.h
        self._constant = np.asfortranarray(h**2 / 4 * tree.K + h / 2 * tree.D)
        held = self._constant != 0.0
        held[t, t] = True  # friction
        self._parts = find_parts(tree, held, [] if stepping.is_driven else t)
        self._axis, k = np.array(t, dtype=np.int64), self._parts.free
        self._mass, self._bias = (MachineCode(tree.functions[name]) for name in ("mass_matrix", "bias"))
        self._work = np.zeros(5 * n + k * k + k + (k + 1) * m + m * (k + 1) + m * m)
        self._grip, gaps = np.zeros(len(t), dtype=np.int64), gaps_of(tree)
        arrays = self._axis, self._grip, self._parts.order, self._constant
        self._gaps = gaps.index, gaps.half, gaps.stiffness, gaps.damping
        lapack = (routine(cython_lapack, name) for name in ("dposv", "dpotrs"))
        self._layout = _Layout(
            n, m, k, self._parts.heavy, len(t), stepping.substeps, stepping.passes, h, stepping.friction,
            FRICTION_SLOPE, FAST,
            *map(place, arrays), gaps.index.size, *map(place, self._gaps),
            *(entries.layout for entries in self._parts.entries),
            self._mass.address, self._bias.address, *self._loops(tree),
            routine(cython_blas, "dsyr2k"), *lapack, place(self._work),
        )  # fmt: skip
        self._q, self._v, self._dv, self._u = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(len(t))
        self._call = code.flexarm_advance
        self._call.restype = ctypes.c_int64
        q, v, u, dv = (ctypes.c_void_p(place(x)) for x in (self._q, self._v, self._u, self._dv))
        layout = ctypes.c_void_p(ctypes.addressof(self._layout))
        self._arguments = (layout, q, v, u if stepping.is_driven else None, dv)

    def advance(self, q: Array, v: Array, u: Array) -> tuple[Array, Array, Array]:
        """See Period."""
        if self._is_changed:
            return self._plain.advance(q, v, u)
        self._q[:], self._v[:], self._u[:] = q, v, u
        if not self._stepping.is_driven:
            self._dv[self._axis] = self._stepping.h * self._u
        if not self._call(*self._arguments):
            return self._plain.advance(q, v, u)
        return self._q.copy(), self._v.copy(), self._dv / self._stepping.h

    def follow(self, tree: ReducedTree) -> None:
        """See Period."""
        self._is_changed = tree is not self._compiled
        self._plain.follow(tree)

    def _loops(self, tree: ReducedTree) -> tuple[int, ...]:
        """Return where rows, loops, and what closes them are; nowhere without loops."""
        if not tree.n_c:
            return 0, 0, 0
        self._closing, self._rows = tree.closing, MachineCode(tree.functions["constraints"])
        return self._rows.address, *code_places(tree.closing, "flexarm_close")


def make_period(tree: ReducedTree, stepping: Stepping) -> Period:
    """Return the fastest way that this machine allows."""
    is_compiled = all(tree.functions[name].library is not None for name in ("mass_matrix", "bias"))
    is_ready = is_compiled and (not tree.n_c or isinstance(tree.closing, MachineClosing))
    code = load_code(SOURCE) if is_ready else None
    return PlainPeriod(tree, stepping) if code is None else MachinePeriod(tree, stepping, code)


def routine(module: ModuleType, name: str) -> int:
    """Return the address of a BLAS or LAPACK routine that SciPy offers to compiled code."""
    capsule = module.__pyx_capi__[name]
    name_of, pointer_of = ctypes.pythonapi.PyCapsule_GetName, ctypes.pythonapi.PyCapsule_GetPointer
    name_of.restype, name_of.argtypes = ctypes.c_char_p, [ctypes.py_object]
    pointer_of.restype, pointer_of.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    return int(pointer_of(capsule, name_of(capsule)))


def place(array: NDArray[Any]) -> int:
    """Return the address of an array's data."""
    return int(array.ctypes.data)
