"""HPIPM's shared library, which comes inside CasADi's wheel, called by ctypes.

HPIPM solves programs with the structure of optimal control by an interior-point method whose linear algebra
is a Riccati recursion [Frison2020]. Its objects are structs whose size only the library knows: it says how
large each one and its memory are, and fills both; here they are two byte buffers that live together.
"""

from __future__ import annotations

import ctypes
from functools import cache
from importlib.util import find_spec
from pathlib import Path

LIBRARY = "libhpipm.so"
PREFIX = "d_ocp_qp"


class MissingHpipmError(RuntimeError):
    """CasADi is here without HPIPM."""


class HpipmObject:
    """One of HPIPM's structs and the memory it points into.

    Attributes:
        pointer: To the struct, as HPIPM's functions take it.
    """

    def __init__(self, kind: str, *made_from: ctypes.c_void_p | int) -> None:
        """Make an object.

        Args:
            kind: Infix of its functions: ``_dim`` dimensions, "" the program, ``_ipm_arg`` options,
                ``_sol`` answer, ``_ipm_ws`` workspace.
            made_from: What its size depends on: objects made before, or the number of stages.
        """
        library, name = load_hpipm(), PREFIX + kind
        struct_size, memory_size = library[f"{name}_strsize"], library[f"{name}_memsize"]
        struct_size.restype = memory_size.restype = ctypes.c_size_t
        self._struct = ctypes.create_string_buffer(struct_size())
        self._memory = ctypes.create_string_buffer(memory_size(*made_from))
        self.pointer = ctypes.cast(self._struct, ctypes.c_void_p)
        library[f"{name}_create"](*made_from, self.pointer, ctypes.cast(self._memory, ctypes.c_void_p))


@cache
def load_hpipm() -> ctypes.CDLL:
    """Return the library.

    Raises:
        MissingHpipmError: This CasADi came without it, as other builds than the wheel may.
    """
    spec = find_spec("casadi")
    folder = Path(spec.origin).parent if spec and spec.origin else Path()
    try:
        return ctypes.CDLL(str(folder / LIBRARY))
    except OSError as error:
        raise MissingHpipmError(f"no {LIBRARY} beside CasADi in {folder}: {error}") from None


def set_option(options: HpipmObject, name: str, value: float) -> None:
    """Set an option of the interior-point method; whole numbers and others are different types there."""
    number = ctypes.c_int(value) if isinstance(value, int) else ctypes.c_double(value)
    load_hpipm()[f"{PREFIX}_ipm_arg_set_{name}"](ctypes.byref(number), options.pointer)
