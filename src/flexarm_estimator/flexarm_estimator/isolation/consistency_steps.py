"""The steps of a consistency run in machine code, where there is a compiler: one call for each."""

from __future__ import annotations

import ctypes
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.isolation.window import WindowStep
from flexarm_model.machine_code import load_code

Array = NDArray[np.float64]
SOURCE = Path(__file__).with_name("consistency_steps.c")


class RunArrays(NamedTuple):
    """What a run works on; every array is contiguous and stays where it is.

    Attributes:
        Y, u, ignored: Data (k, m, columns), [tau; 1] (k, n_u + 1), rows to be left out (k, m).
        X, P: State of every column (n_x, columns), covariance (n_x, n_x); overwritten by every step.
        Z, diagonals, predicted, variance: Results, (k, m, columns), (k, m) three times.
        running: Misfit of every hypothesis so far, (n_h,).
    """

    Y: Array
    u: Array
    ignored: NDArray[np.bool_]
    X: Array
    P: Array
    Z: Array
    diagonals: Array
    predicted: Array
    variance: Array
    running: Array


class _Layout(ctypes.Structure):
    """``struct run`` of the C file."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in ("n", "m", "columns", "hypotheses", "inputs")),
        *((name, ctypes.c_double) for name in ("excluded", "largest")),
        *((name, ctypes.c_void_p) for name in (*RunArrays._fields, "work")),
    )


class MachineSteps:
    """Steps of one run."""

    def __init__(
        self, code: ctypes.PyDLL, arrays: RunArrays, hypotheses: int, ignored: float, largest: float
    ) -> None:
        """Bind the arrays; see ``bind_steps``."""
        (n, columns), m, inputs = arrays.X.shape, arrays.Y.shape[1], arrays.u.shape[1]
        lead = n + m
        work = np.empty(lead * (lead + n + columns))
        sizes = n, m, columns, hypotheses, inputs
        places = (array.ctypes.data for array in (*arrays, work))
        self._layout = _Layout(*sizes, ignored, largest, *places)
        self._kept, self._at = (arrays, work), ctypes.byref(self._layout)
        self._call = code.flexarm_consistency_step
        self._call.restype = ctypes.c_int64

    def compute(self, k: int, step: WindowStep) -> bool:
        """Compute step ``k``; False when rounding forbids it."""
        return bool(self._call(self._at, ctypes.c_int64(k), ctypes.byref(step.layout)))


def bind_steps(arrays: RunArrays, hypotheses: int, ignored: float, largest: float) -> MachineSteps | None:
    """Return the steps of a run; None where there is no working compiler.

    Args:
        arrays: Of the run.
        hypotheses: Number of columns that the inputs act on; the others are offsets.
        ignored: Factor of the noise of a row that is left out.
        largest: Squared sigmas that a datum counts at most.
    """
    code = load_steps()
    return None if code is None else MachineSteps(code, arrays, hypotheses, ignored, largest)


@cache
def load_steps() -> ctypes.PyDLL | None:
    """Return the machine code, None where there is no working compiler; the first time this compiles."""
    return load_code(SOURCE)
