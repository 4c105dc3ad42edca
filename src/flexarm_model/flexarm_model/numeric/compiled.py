"""CasADi functions as machine code, cached by content; CasADi's virtual machine without a compiler.

Both give the same numbers; where the cache is: library_cache.py.
"""

from __future__ import annotations

import os
import shutil
import threading
from collections.abc import Collection, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from flexarm_model.numeric.library_cache import FLAGS, keep_library, tell

Array = NDArray[np.float64]

GENERATED = ("-Og", *FLAGS[1:])  # the same speed for straight code, compiled in two thirds of the time


class WorkSizes(NamedTuple):
    """Numbers of pointers, integers and reals that generated code works with."""

    arg: int
    res: int
    iw: int
    w: int


class _Room(threading.local):
    """Buffers of one thread for a function; ``local`` gives every thread one of its own.

    Attributes:
        outputs: Results.
        parts: Inputs, what evaluates, and what a call returns; one attribute, for each costs a call 40 ns.
    """

    def __init__(self, function: ca.Function, matrices: Collection[int]) -> None:
        """Make room; every thread comes here when it first calls the function."""
        buffer: Any  # its stub asks for a size that the method does not take
        buffer, evaluate = function.buffer()
        flat_in = [np.zeros(max(function.numel_in(i), 1)) for i in range(function.n_in())]
        flat_out = [np.zeros(max(function.numel_out(i), 1)) for i in range(function.n_out())]
        for i, flat in enumerate(flat_in):
            buffer.set_arg(i, flat.data)
        for i, flat in enumerate(flat_out):
            buffer.set_res(i, flat.data)
        inputs = [_shaped(flat, function.size_in(i)) for i, flat in enumerate(flat_in)]
        self.outputs = tuple(
            _shaped(flat, function.size_out(i), i in matrices) for i, flat in enumerate(flat_out)
        )
        result: Any = self.outputs[0] if len(self.outputs) == 1 else self.outputs
        self.parts = inputs, evaluate, result
        self._buffer = buffer  # what evaluates needs it


class FastFunction:
    """A CasADi function on fixed NumPy buffers: no allocation per call.

    Inputs are copied into ``inputs``; results appear in ``outputs`` and are overwritten by the next
    call in the same thread. Every thread has buffers of its own. Matrices are column-major, as CasADi stores
    them; one with a single column is a vector unless it is said to be a matrix.

    Attributes:
        library: Where its machine code is; None on the virtual machine.
    """

    def __init__(
        self, function: ca.Function, library: Path | None = None, matrices: Collection[int] = ()
    ) -> None:
        """Wrap a function whose outputs are dense.

        Args:
            function: The function.
            library: Where its machine code is.
            matrices: Outputs that stay matrices (n, 1) where they have one column.
        """
        self.name: str = function.name()
        self.library = library
        self._function = function  # keeps the library loaded
        self._room = _Room(function, matrices)

    @property
    def inputs(self) -> list[Array]:
        """Buffers of the arguments in the calling thread."""
        return self._room.parts[0]

    @property
    def outputs(self) -> tuple[Array, ...]:
        """Buffers of the results in the calling thread."""
        return self._room.outputs

    @property
    def sizes(self) -> WorkSizes:
        """What its code works with."""
        f = self._function
        return WorkSizes(f.sz_arg(), f.sz_res(), f.sz_iw(), f.sz_w())

    def __call__(self, *arguments: Array | float) -> Any:
        """Evaluate; returns the one output, or a tuple of them.

        They are views that the next call in the same thread overwrites.
        """
        inputs, evaluate, result = self._room.parts
        for array, argument in zip(inputs, arguments, strict=True):
            array[...] = argument
        evaluate()
        return result


def compile_functions(
    functions: Mapping[str, ca.Function],
    use_compiler: bool = True,
    matrices: Mapping[str, Collection[int]] | None = None,
) -> dict[str, FastFunction]:
    """Compile functions together, or load them from the cache.

    Args:
        functions: By name; SX or MX functions.
        use_compiler: False runs them on CasADi's virtual machine.
        matrices: By name, the outputs that stay matrices (n, 1) where they have one column.
    """
    kept = matrices or {}
    dense = {name: _densify(name, function) for name, function in functions.items()}
    compiler = find_compiler() if use_compiler else None
    library = _library(dense, compiler) if compiler else None
    if library is None:
        return {name: FastFunction(function, None, kept.get(name, ())) for name, function in dense.items()}
    return {
        name: FastFunction(ca.external(name, str(library)), library, kept.get(name, ())) for name in dense
    }


class FunctionTable(Mapping[str, FastFunction]):
    """Functions of a model by name, each compiled (or loaded from the cache) when it is first asked for."""

    def __init__(
        self,
        functions: Mapping[str, ca.Function],
        use_compiler: bool = True,
        matrices: Mapping[str, Collection[int]] | None = None,
    ) -> None:
        """Keep the functions; see ``compile_functions`` for the arguments."""
        self._functions, self._use_compiler = dict(functions), use_compiler
        self._matrices = matrices
        self._ready: dict[str, FastFunction] = {}

    def __getitem__(self, name: str) -> FastFunction:
        """Return a function.

        Raises:
            KeyError: There is none of this name.
        """
        if name not in self._ready:
            one = {name: self._functions[name]}
            self._ready[name] = compile_functions(one, self._use_compiler, self._matrices)[name]
        return self._ready[name]

    def __iter__(self) -> Iterator[str]:
        """Go through the names."""
        return iter(self._functions)

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self._functions)


def _shaped(flat: Array, size: tuple[int, int], is_matrix: bool = False) -> Array:
    """View a buffer as a column-major matrix, or as a vector where it has one column and is no matrix."""
    rows, columns = size
    return (
        flat[: rows * columns]
        if columns == 1 and not is_matrix
        else flat[: rows * columns].reshape(size, order="F")
    )


def find_compiler() -> str | None:
    """Return the C compiler's path, or None when there is none."""
    return _find_compiler(os.environ.get("PATH"))


@cache
def _find_compiler(path: str | None) -> str | None:
    """Look along a path once; a model that is adopted while the arm moves asks again."""
    found = (shutil.which(name, path=path) for name in ("gcc", "cc", "g++", "clang"))
    compiler = next((compiler for compiler in found if compiler), None)
    if compiler is None:
        tell("no C compiler (gcc, cc, g++ or clang) in PATH; slower code runs instead")
    return compiler


def _densify(name: str, function: ca.Function) -> ca.Function:
    inputs: Any = function.sx_in() if function.is_a("SXFunction") else function.mx_in()
    outputs: Any = function.call(inputs)
    return ca.Function(name, inputs, [ca.densify(output) for output in outputs])


def _library(functions: Mapping[str, ca.Function], compiler: str) -> Path | None:
    """Return the library of functions; their C code is generated only where it is not kept yet."""

    def write(folder: Path) -> Path:
        """Generate the C code."""
        generator = ca.CodeGenerator("flexarm_code.c")
        for function in functions.values():
            generator.add(function)
        return Path(generator.generate(str(folder) + os.sep))

    identity = [ca.CasadiMeta.version(), *(function.serialize() for function in functions.values())]
    return keep_library("\n".join(identity).encode(), write, compiler, GENERATED)
