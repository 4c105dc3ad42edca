"""What a served model leaves out, in machine code: one call for what takes a hundred with NumPy.

Both give the same to rounding. A late frame of a camera has it computed again for every period since.
"""

from __future__ import annotations

import ctypes
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filters.flow import StateFlow
from flexarm_estimator.filters.left_out import LeftOut, PlainLeftOut, Reach
from flexarm_estimator.filters.moving_arm import MovingArm
from flexarm_estimator.state.process import CACHE_SIZE, Transition
from flexarm_estimator.steps.bilinear import Bilinear, columns
from flexarm_model.numeric.compiled import FastFunction
from flexarm_model.numeric.machine_code import MachineCode, load_code
from flexarm_model.tree.closing import MachineClosing, code_places
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
SOURCE = Path(__file__).with_name("machine_left_out.c")


class _BilinearLayout(ctypes.Structure):
    """``struct bilinear`` of the C file."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("rows", "count")),
        *((name, ctypes.c_void_p) for name in ("columns", "place", "scale")),
    )


class _Layout(ctypes.Structure):
    """``struct left_out`` of the C file."""

    _fields_ = [
        *((name, ctypes.c_int64) for name in ("n_x", "n_u", "n", "n_q", "n_c", "n_y", "n_modes")),
        *((name, ctypes.c_void_p) for name in ("modes", "reach", "origin", "Phi", "free")),
        *((name, ctypes.c_void_p) for name in ("loops", "close", "move", "motion", "drift", "rows")),
        *((name, ctypes.c_void_p) for name in ("step", "served", "forces", "before", "out", "work")),
    ]


class _Terms:
    """A bilinear function for C.

    Attributes:
        address: Where its layout is.
        count: Number of its columns.
    """

    def __init__(self, function: Bilinear) -> None:
        """Keep the columns that are not zero."""
        self._kept = columns(function)
        self.count = self._kept.place.size
        arrays = (array.ctypes.data for array in self._kept)
        self._layout = _BilinearLayout(len(function.of_x), self.count, *arrays)
        self.address = ctypes.addressof(self._layout)


class MachineLeftOut(LeftOut):
    """In machine code, on fixed buffers; where that does not arrive NumPy says why."""

    def __init__(
        self, tree: ReducedTree, flow: StateFlow, served: Bilinear, reach: Reach, code: ctypes.PyDLL
    ) -> None:
        """Bind the compiled functions of an arm to the state of a served model."""
        self._plain, self._steps = PlainLeftOut(flow, served, reach), dict[float, _Terms]()
        n_x, n_u, (n_q, n) = served.of_x.shape[1], served.of_u.shape[1], flow.arm.Phi.shape
        same = served.of_x.copy()
        same[n:] -= flow.rows_of_rest  # what the other states add to the rows
        self._served, self._forces = _Terms(served._replace(of_x=same)), _Terms(flow.forces)
        self._before, self._out = np.zeros(n_x + n_u), np.zeros(len(same) + n_u)
        self._x, self._u = self._before[:n_x], self._before[n_x:]
        sizes = n_x, n_u, n, n_q, tree.n_c, len(same) - n, reach.places.size
        frame = [np.array(part, order="C") for part in (flow.arm.origin, flow.arm.Phi, flow.arm.free)]
        arrays = [np.array(reach.places, dtype=np.int64), np.array(reach.most), *frame]
        functions = [MachineCode(function) if function else None for function in _functions(tree, flow.arm)]
        self._layout = _Layout(
            *(*sizes, *(array.ctypes.data for array in arrays), *_loops(tree)),
            *(function.address if function else None for function in functions),
            *(None, self._served.address, self._forces.address),
            *(self._before.ctypes.data, self._out.ctypes.data, None),
        )
        self._kept = arrays, functions  # the layout has only their addresses
        self._columns, self._room = -1, n_x + n_u + 5 * n_q + tree.n_c + n * (1 + 2 * n_q + n)
        self._reserve(max(self._served.count, self._forces.count))
        self._at, self._call = ctypes.c_void_p(ctypes.addressof(self._layout)), code.flexarm_left_out
        self._call.restype = ctypes.c_int64

    def at(self, x: Array, step: Transition, u: Array) -> Array:
        """See LeftOut."""
        terms = self._steps.get(step.dt)
        if terms is None:
            terms = self._keep(step)
        self._x[:], self._u[:], self._layout.step = x, u, terms.address
        return self._out.copy() if self._call(self._at) else self._plain.at(x, step, u)

    def _keep(self, step: Transition) -> _Terms:
        """Return a step for C."""
        terms = _Terms(Bilinear(step.A, step.B, step.slopes))
        if len(self._steps) >= CACHE_SIZE:
            self._steps.clear()
        self._steps[step.dt] = terms
        self._reserve(terms.count)
        return terms

    def _reserve(self, columns: int) -> None:
        """Make room to work with so many columns."""
        if columns > self._columns:
            self._columns = columns
            self._work = np.zeros(self._room + columns)
            self._layout.work = self._work.ctypes.data


def make_left_out(flow: StateFlow, served: Bilinear, reach: Reach) -> LeftOut:
    """Return the fastest that arm and machine allow.

    Args:
        flow: Motion of the arm.
        served: ``[xi''; y]`` as the model serves them.
        reach: How far the mean may be.
    """
    tree = flow.arm.tree
    if not isinstance(tree, ReducedTree) or not _is_compiled(tree, flow.arm):
        return PlainLeftOut(flow, served, reach)
    code = load_code(SOURCE)
    if code is None:
        return PlainLeftOut(flow, served, reach)
    return MachineLeftOut(tree, flow, served, reach, code)


def _functions(tree: ReducedTree, arm: MovingArm) -> tuple[FastFunction, FastFunction | None, FastFunction]:
    """Return motion, drift (None without loops) and rows."""
    drift = arm.functions["drift"] if tree.n_c else None
    return tree.functions["motion"], drift, arm.functions["rows"]


def _is_compiled(tree: ReducedTree, arm: MovingArm) -> bool:
    """Tell whether all of it is machine code; a tree with other springs than those compiled is not."""
    closes = not tree.n_c or isinstance(tree.closing, MachineClosing)
    return closes and all(
        function is None or (isinstance(function, FastFunction) and bool(function.library))
        for function in _functions(tree, arm)
    )


def _loops(tree: ReducedTree) -> tuple[int, ...]:
    """Return the addresses of the loops and of the code that closes them and moves within; zeros without."""
    names = "flexarm_close", "flexarm_move_closed"
    return code_places(tree.closing, *names) if tree.n_c else (0,) * (1 + len(names))
