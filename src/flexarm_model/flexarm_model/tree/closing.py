"""Closes the loops of an arm again and again: in machine code, or with NumPy where there is no compiler.

Both give the same to rounding; ``closure`` has the equations.
"""

from __future__ import annotations

import ctypes
import threading
from abc import ABC, abstractmethod
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexarm_model.numeric.compiled import FastFunction
from flexarm_model.numeric.machine_code import MachineCode, load_code
from flexarm_model.tree.closure import (
    ITERATIONS,
    LONGEST_STEP,
    TOLERANCE,
    Loops,
    close_loops,
    follow,
)

Array = NDArray[np.float64]
SOURCE = Path(__file__).with_name("closing.c")
RATES = 6  # of a tip: so many rows other C code has follow the loops, also of an arm with fewer coordinates


class Closing(ABC):
    """Moves the dependent coordinates."""

    @abstractmethod
    def close(self, q: Array, v: Array | None = None) -> Array:
        """Return q (n_q,) with the loops closed; dependent rates in ``v`` (n_q,) are made to follow.

        Raises:
            ClosureError: They do not close from here.
        """

    @abstractmethod
    def follow(self, J: Array, q: Array) -> Array:
        """Return rows J (k, n_q) per rate with dependent rates following the others, at a closed pose q."""


class PlainClosing(Closing):
    """With NumPy."""

    def __init__(self, rows: FastFunction, loops: Loops, name: str) -> None:
        """Take the function q -> (c, G), the loops, and the manipulator's name."""
        self._rows, self._loops, self._name = rows, loops, name

    def close(self, q: Array, v: Array | None = None) -> Array:
        """See Closing."""
        d = self._loops.dependent
        q = close_loops(self._evaluate, q, d, self._name)
        if v is not None:
            G = self._evaluate(q)[1]
            v[d] -= np.linalg.solve(G[:, d], G @ v)
        return q

    def follow(self, J: Array, q: Array) -> Array:
        """See Closing."""
        return follow(J, self._evaluate(q)[1], self._loops.dependent)

    def _evaluate(self, q: Array) -> tuple[Array, Array]:
        c, G = self._rows(q)
        return np.atleast_1d(c).copy(), np.array(G)


class _Layout(ctypes.Structure):
    """``struct loops`` of the C file."""

    _fields_ = [
        *((name, ctypes.c_int64) for name in ("n", "m", "iterations")),
        *((name, ctypes.c_double) for name in ("tolerance", "longest_step")),
        *((name, ctypes.c_void_p) for name in ("dependent", "rows", "work")),
    ]


class _Room(threading.local):
    """Buffers of one thread; ``local`` gives every thread some of its own.

    Attributes:
        parts: Coordinates and rates, (n,) each, and what C takes to close loops at rest, to close them in
            motion, and to have rows follow them.
    """

    def __init__(self, layout: int, n: int) -> None:
        """Make room; every thread comes here when it first closes the loops."""
        q, v = np.zeros(n), np.zeros(n)
        at, place, rates = (ctypes.c_void_p(p) for p in (layout, _place(q), _place(v)))
        self.parts = q, v, (at, place, None), (at, place, rates), (at, place)


class MachineClosing(Closing):
    """In machine code; where that does not arrive NumPy says why.

    Attributes:
        address: Where the layout for C is.
        code: The library; ``flexarm_close(layout, q, v)`` serves other C code, too, and so does,
            right after it, ``flexarm_follow_closed(layout, k, J)`` with at most ``RATES`` rows.
    """

    def __init__(self, rows: FastFunction, loops: Loops, name: str, code: ctypes.PyDLL) -> None:
        """Bind the function q -> (c, G), which is compiled."""
        self._plain, self._rows, self.code = PlainClosing(rows, loops, name), MachineCode(rows), code
        m, n = rows.outputs[1].shape
        self._most = max(n, RATES)
        self._dependent = np.array(loops.dependent, dtype=np.int64)
        self._work = np.zeros(m * (m + self._most))  # C has Python's lock while it needs it
        sizes = (n, m, ITERATIONS, TOLERANCE, LONGEST_STEP)
        places = (self._dependent.ctypes.data, self._rows.address, self._work.ctypes.data)
        self._layout = _Layout(*sizes, *places)
        self.address = ctypes.addressof(self._layout)
        self._room = _Room(self.address, n)
        self._close, self._follow = code.flexarm_close, code.flexarm_follow
        self._close.restype = self._follow.restype = ctypes.c_int64

    def close(self, q: Array, v: Array | None = None) -> Array:
        """See Closing."""
        own_q, own_v, at_rest, moving, _ = self._room.parts
        own_q[:] = q
        if v is not None:
            own_v[:] = v
        if not self._close(*(at_rest if v is None else moving)):
            return self._plain.close(q, v)
        if v is not None:
            v[:] = own_v
        return own_q.copy()

    def follow(self, J: Array, q: Array) -> Array:
        """See Closing."""
        rows: Array = np.array(J, order="F")
        own_q, *_, at = self._room.parts
        own_q[:] = q
        fits = len(rows) <= self._most
        if not fits or not self._follow(*at, ctypes.c_int64(len(rows)), ctypes.c_void_p(_place(rows))):
            return self._plain.follow(J, q)
        return rows


def make_closing(rows: FastFunction, loops: Loops, name: str) -> Closing:
    """Return the fastest closing that this machine allows; ``rows`` is q -> (c, G)."""
    code = load_code(SOURCE) if rows.library is not None else None
    return PlainClosing(rows, loops, name) if code is None else MachineClosing(rows, loops, name, code)


def code_places(closing: Closing, *names: str) -> tuple[int, ...]:
    """Return the addresses of loops in machine code and of functions of the C file, for other C code.

    Args:
        closing: Of the loops.
        names: Of the functions.

    Returns:
        The loops' address, then the functions'; zeros for loops that NumPy closes.
    """
    if not isinstance(closing, MachineClosing):
        return (0,) * (1 + len(names))
    found = (ctypes.cast(closing.code[name], ctypes.c_void_p).value or 0 for name in names)
    return closing.address, *found


def _place(array: Array) -> int:
    return int(array.ctypes.data)
