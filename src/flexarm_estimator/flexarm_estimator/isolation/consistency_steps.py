"""Steps of a consistency run in machine code, where there is a compiler: one call for many that are alike."""

from __future__ import annotations

import ctypes
import math
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.isolation.hypotheses import Hypotheses
from flexarm_estimator.isolation.window import WindowStep
from flexarm_model.numeric.machine_code import load_code

Array = NDArray[np.float64]
SOURCE = Path(__file__).with_name("consistency_steps.c")


class Data(NamedTuple):
    """What a run explains.

    Attributes:
        y, ignored: What was said, NaN where nothing; rows to be left out, which those are; (k, m).
        hypotheses: A column each.
        offsets: One sigma of a constant and of a ramp in every row, (m, 2); empty: no such columns.
    """

    y: Array
    ignored: NDArray[np.bool_]
    hypotheses: Hypotheses
    offsets: Array

    @property
    def columns(self) -> int:
        """Number of hypotheses and offsets."""
        return len(self.hypotheses.all) + 2 * len(self.offsets)


class Room(NamedTuple):
    """What a run works on, in one block of memory.

    Attributes:
        u: [tau; 1] of every step, with what the filter adds in front, (k, n_inputs).
        X, P: State of every column (n_x, columns), covariance (n_x, n_x); overwritten by every step.
        x: State of the hypothesis that explains best so far, (n_x,).
        Z: (k, m, columns); of the newest step alone, (1, m, columns), when there are no offsets.
        predicted, variance: Of "all well", (k, m).
        misfit, log_det: Sums so far by halves of the window, (2, n_h), (2,).
        squares, used: Sums so far of innovations over their variance, squared, and their number, (m,).
        block: All of it, and room to work in.
    """

    u: Array
    X: Array
    P: Array
    x: Array
    Z: Array
    predicted: Array
    variance: Array
    misfit: Array
    log_det: Array
    squares: Array
    used: Array
    block: Array


def make_room(data: Data, n_x: int, inputs: int) -> Room:
    """Return room for a run over ``data`` with ``n_x`` states and so many inputs; all is zero."""
    (k, m), columns = data.y.shape, data.columns
    shapes = (
        (k, inputs), (n_x, columns), (n_x, n_x), (n_x,), (k if len(data.offsets) else 1, m, columns),
        (k, m), (k, m), (2, len(data.hypotheses.all)), (2,), (m,), (m,),
    )  # fmt: skip
    lead = n_x + m
    block = np.zeros(sum(map(math.prod, shapes)) + lead * (lead + n_x + columns))
    arrays, start = [], 0
    for shape in shapes:
        end = start + math.prod(shape)
        arrays.append(block[start:end].reshape(shape))
        start = end
    return Room._make([*arrays, block])


class _Layout(ctypes.Structure):
    """``struct run`` of the C file."""

    _fields_ = (
        *((n, ctypes.c_int64) for n in ("steps", "n", "m", "columns", "hypotheses", "inputs", "kept")),
        *((name, ctypes.c_double) for name in ("excluded", "largest")),
        *((n, ctypes.c_void_p) for n in ("y", "ignored", "source", "sign", "offsets", "block")),
    )


class MachineSteps:
    """Steps of one run."""

    def __init__(self, code: ctypes.PyDLL, data: Data, room: Room, ignored: float, largest: float) -> None:
        """Bind the arrays; see ``bind_steps``."""
        (steps, m), (n, columns), hypotheses = data.y.shape, room.X.shape, data.hypotheses
        sizes = steps, n, m, columns, len(hypotheses.all), room.u.shape[1], len(room.Z)
        arrays = data.y, data.ignored, hypotheses.source, hypotheses.sign, data.offsets, room.block
        self._layout = _Layout(*sizes, ignored, largest, *(array.ctypes.data for array in arrays))
        self._kept, self._at = arrays, ctypes.byref(self._layout)
        self._call, self._find = code.flexarm_consistency_steps, code.flexarm_consistency_extremes
        self._call.restype = ctypes.c_int64

    def compute(self, first: int, count: int, step: WindowStep) -> bool:
        """Compute ``count`` steps with the same matrices; False when rounding forbids it."""
        numbers = ctypes.c_int64(first), ctypes.c_int64(count)
        return bool(self._call(self._at, *numbers, ctypes.byref(step.layout)))

    def extremes(self) -> tuple[float, float]:
        """Return the largest mean square of a row and the largest gain."""
        found = (ctypes.c_double * 2)()
        self._find(self._at, found)
        return found[0], found[1]


def bind_steps(data: Data, room: Room, ignored: float, largest: float) -> MachineSteps | None:
    """Return the steps of a run; None where there is no working compiler.

    Args:
        data: What is explained; every array is contiguous.
        room: Where.
        ignored: Factor of the noise of a row that is left out.
        largest: Squared sigmas that a datum counts at most.
    """
    code = load_steps()
    return None if code is None else MachineSteps(code, data, room, ignored, largest)


def survey(y: Array, ignored: NDArray[np.bool_], most: float) -> list[int] | None:
    """Ignore in place what was not said, and all of a row that repeats its last value too often.

    Args:
        y: What was said, NaN where nothing, (k, m); contiguous, as the other.
        ignored: What is to be left out, (k, m).
        most: Times that a row may repeat itself.

    Returns:
        Rows of which something is left; None where there is no working compiler, and nothing has been done.
    """
    code = load_steps()
    if code is None:
        return None
    k, m = y.shape
    heard, repeated = (ctypes.c_uint8 * m)(), (ctypes.c_double * m)()
    sizes, places = (ctypes.c_int64(k), ctypes.c_int64(m)), (y.ctypes.data, ignored.ctypes.data)
    code.flexarm_survey(*sizes, ctypes.c_double(most), *map(ctypes.c_void_p, places), heard, repeated)
    return [i for i, is_heard in enumerate(heard) if is_heard]


@cache
def load_steps() -> ctypes.PyDLL | None:
    """Return the machine code, None where there is no working compiler; the first time this compiles."""
    return load_code(SOURCE)
