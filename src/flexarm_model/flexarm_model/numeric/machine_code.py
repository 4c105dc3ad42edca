"""Compiled functions of a model as hand-written C code calls them: an address, and room to work in.

One call from Python then does what would take hundreds; see ``closing.c``.
"""

from __future__ import annotations

import ctypes
from functools import cache
from pathlib import Path

import numpy as np

from flexarm_model.numeric.compiled import FastFunction, find_compiler
from flexarm_model.numeric.library_cache import FLAGS, build_library, cache_folder

FAST = ("-std=c99", "-O3", *FLAGS[1:])  # for the few loops that are written by hand


class CFunction(ctypes.Structure):
    """``struct function`` of the C files."""

    _fields_ = [(name, ctypes.c_void_p) for name in ("evaluate", "arg", "res", "iw", "w")]


class MachineCode:
    """A compiled function for C.

    Attributes:
        layout: ``struct function``; the C code sets its arguments, results lie in buffers of their own.
    """

    def __init__(self, function: FastFunction) -> None:
        """Bind a function.

        Raises:
            ValueError: It is not compiled.
        """
        if function.library is None:
            raise ValueError(f"{function.name} is not compiled")
        sizes, self._library = function.sizes, _open(function.library)
        self._results = [np.zeros(max(array.size, 1)) for array in function.outputs]
        self._arg, self._res = (ctypes.c_void_p * sizes.arg)(), (ctypes.c_void_p * sizes.res)()
        self._res[: len(self._results)] = [array.ctypes.data for array in self._results]
        self._iw, self._w = np.zeros(sizes.iw + 1, dtype=np.int64), np.zeros(sizes.w + 1)
        self.layout = CFunction(
            ctypes.cast(getattr(self._library, function.name), ctypes.c_void_p),
            ctypes.cast(self._arg, ctypes.c_void_p),
            ctypes.cast(self._res, ctypes.c_void_p),
            self._iw.ctypes.data,
            self._w.ctypes.data,
        )

    @property
    def address(self) -> int:
        """Where the layout is."""
        return ctypes.addressof(self.layout)


def load_code(source: Path) -> ctypes.PyDLL | None:
    """Return a C file of ours as a library; None where there is no working compiler.

    It is built and loaded once: a model that is adopted while the arm moves finds it ready.
    """
    compiler = find_compiler()
    return None if compiler is None else _load(source, compiler, cache_folder())


@cache
def _load(source: Path, compiler: str, folder: Path) -> ctypes.PyDLL | None:
    """Build a library into the folder of compiled code and load it."""
    library = build_library(source, compiler, FAST)
    return None if library is None else _open(library)


@cache
def _open(library: Path) -> ctypes.PyDLL:
    """Load a library; its name is the hash of what it is made of."""
    return ctypes.PyDLL(str(library))
