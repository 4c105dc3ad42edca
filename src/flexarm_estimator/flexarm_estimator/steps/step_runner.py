"""Runs joint steps one after the other: in machine code, or with NumPy where there is no working C compiler.

Both give the same beliefs to rounding. The code works on sizes that it is given, so that one library
serves every model, period and set of sensors, and nothing is compiled while the arm moves.
"""

from __future__ import annotations

import ctypes
from abc import ABC, abstractmethod
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from flexarm_estimator.filter import Belief, normalised_square
from flexarm_estimator.state.state_limits import StateLimits
from flexarm_estimator.steps.joint_step import PreparedStep
from flexarm_model.numeric.machine_code import load_code

SOURCE = Path(__file__).with_name("joint_steps.c")
_PANEL = 4  # columns of a factor that are made together ("BROAD" of tiles.h)
_FIRST_LENGTH = 64  # steps in one call; grows


class StepRunner(ABC):
    """Computes steps in a row."""

    @abstractmethod
    def run(self, start: Belief, steps: Sequence[PreparedStep]) -> int:
        """Run ``steps`` from the belief ``start`` on; return how many succeeded in a row.

        Belief, innovation and its normalised square (nis) are left in each step. The belief of the first
        that fails, and of those after it, is not touched. A step that leads beyond the limits is the last
        one, too: who goes on leads the state back first.
        """


class _Run(ctypes.Structure):
    """``struct run`` of the C file; one argument is passed in a third of the time of seven."""

    _fields_ = (
        ("count", ctypes.c_int64),
        *((name, ctypes.c_void_p) for name in ("layouts", "records", "x", "P", "work")),
        *(("limited", ctypes.c_int64), ("at", ctypes.c_void_p), ("most", ctypes.c_void_p)),
    )


class PlainRunner(StepRunner):
    """With NumPy."""

    def __init__(self, limits: StateLimits | None = None) -> None:
        """Stop beyond ``limits``."""
        self._limits = limits or StateLimits({})

    def run(self, start: Belief, steps: Sequence[PreparedStep]) -> int:
        """See StepRunner."""
        for done, step in enumerate(steps):
            mean, J = step.predict(start)
            if step.stack is not None:
                step.nu[:] = J[: step.nu.size, -1]
                for i, span in enumerate(step.stack.spans):
                    step.nis[i] = normalised_square(step.nu[span], J[span, span])
            belief = step.condition(mean, J)
            if belief is None:
                return done
            step.belief.x[:], step.belief.P[:] = belief
            start = step.belief
            if not self._limits.holds(start):
                return done + 1
        return len(steps)


class CompiledRunner(StepRunner):
    """In machine code, on fixed buffers."""

    def __init__(self, code: ctypes.PyDLL, n_x: int, rows: int, limits: StateLimits) -> None:
        """Bind the code for ``n_x`` states and at most ``rows`` rows in a step."""
        lead = n_x + rows
        self._x, self._P = np.zeros(n_x), np.zeros((n_x, n_x))
        rest = max(n_x * (n_x + lead), 2 * rows * lead, 2 * n_x * lead) + _PANEL * lead
        self._work = np.zeros(2 * lead + lead * lead + n_x * lead + rest)
        self._at, self._most = np.array(limits.places, dtype=np.int64), np.array(limits.most)
        places = (array.ctypes.data for array in (self._x, self._P, self._work))
        bounds = self._at.size, self._at.ctypes.data, self._most.ctypes.data
        self._run = _Run(0, None, None, *places, *bounds)
        self._reserve(_FIRST_LENGTH)
        self._argument = ctypes.c_void_p(ctypes.addressof(self._run))
        self._call = code.flexarm_joint_steps
        self._call.restype = ctypes.c_int64

    def run(self, start: Belief, steps: Sequence[PreparedStep]) -> int:
        """See StepRunner."""
        count = len(steps)
        if count > len(self._layouts):
            self._reserve(2 * count)
        self._run.count = count
        self._x[:], self._P[:] = start
        layouts, records = self._layouts, self._records
        for i, step in enumerate(steps):
            layouts[i], records[i] = step.layout_address, step.record_address
        done: int = self._call(self._argument)
        return done

    def _reserve(self, length: int) -> None:
        self._layouts, self._records = (ctypes.c_void_p * length)(), (ctypes.c_void_p * length)()
        self._run.layouts = ctypes.addressof(self._layouts)
        self._run.records = ctypes.addressof(self._records)


def make_runner(
    n_x: int, rows: int, use_compiler: bool = True, limits: StateLimits | None = None
) -> StepRunner:
    """Return the fastest runner that this machine allows.

    Args:
        n_x: Number of states.
        rows: Largest number of rows in one step.
        use_compiler: False takes NumPy.
        limits: Of states; none if None.
    """
    limits = limits or StateLimits({})
    code = load_code(SOURCE) if use_compiler else None
    return PlainRunner(limits) if code is None else CompiledRunner(code, n_x, rows, limits)
