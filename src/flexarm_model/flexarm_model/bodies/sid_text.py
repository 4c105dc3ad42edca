"""The text of standard input data [Wallrapp1994]: nested blocks of matrices expanded in the coordinates.

::

    new modal                        a block; "new" may be missing
      mdCM                           a matrix M(q) = m0 + sum_k m1(:, :, k) q_k
        order = 1                    0: m0 only
        nrow = 3
        ncol = 1
        nq = 4
        nqn = 0
        structure = 3                0 zero, 1 diagonal, 2 symmetric (either triangle), 3 full
        m0( 1, 1) = 0.25             entries that are not given are zero
        m1( 1, 1, 4) = -0.125
      end mdCM
    end modal

Numbers are written so that they read back bit for bit.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexarm_model.settings.strict_yaml import ConfigError

Array = NDArray[np.float64]
Index = tuple[int, ...]

_ENTRY = re.compile(r"(\w+)\s*\((.*?)\)\s*=\s*(.*)")
_INDEX = re.compile(r"\s*\d{1,9}\s*(,\s*\d{1,9}\s*)*")
_SYMMETRIC, _FULL = 2, 3
_SAME = 1e-9  # of the largest entry: what is given on both sides of the diagonal may differ by so much
_STRUCTURES = range(_FULL + 1)


@dataclass(frozen=True)
class Taylor:
    """A matrix expanded in the coordinates: ``m0`` (r, c) and ``m1`` (r, c, n), or None for order 0."""

    m0: Array
    m1: Array | None = None


@dataclass
class Block:
    """A block while it is read.

    Attributes:
        path: File, for messages.
        line: Where it begins.
        name: What it is.
        label: Text behind "new name =".
        values: Text of every ``key = value``.
        entries: Text of every ``key( indices) = value``, and its line.
        blocks: Blocks inside.
    """

    path: Path
    line: int
    name: str
    label: str = ""
    values: dict[str, str] = field(default_factory=dict)
    entries: dict[tuple[str, Index], tuple[str, int]] = field(default_factory=dict)
    blocks: list[Block] = field(default_factory=list)

    def error(self, message: str, line: int = 0) -> ConfigError:
        """Return the error for a line of the block."""
        return ConfigError(f"{self.path}: line {line or self.line}: {self.name or 'file'}: {message}")

    def block(self, name: str) -> Block:
        """Return the block inside of that name.

        Raises:
            ConfigError: It is missing.
        """
        found = self.find(name)
        if found is None:
            known = ", ".join(block.name for block in self.blocks) or "nothing"
            raise self.error(f"block '{name}' is missing; it holds {known}")
        return found

    def find(self, name: str) -> Block | None:
        """Return the block inside of that name, if there is one."""
        return next((block for block in self.blocks if block.name == name), None)

    def number(self, key: str) -> float:
        """Return the number of a key.

        Raises:
            ConfigError: It is missing or no finite number.
        """
        if key not in self.values:
            raise self.error(f"'{key} = <number>' is missing")
        return self._number(self.values[key], self.line)

    def whole_number(self, key: str, allowed: range) -> int:
        """Return the whole number of a key.

        Raises:
            ConfigError: It is missing or none of those allowed.
        """
        value = self.number(key)
        if value not in allowed:
            limits = f"from {allowed[0]} to {allowed[-1]}"
            raise self.error(f"{key} = {self.values[key]}: expected a whole number {limits}")
        return int(value)

    def text(self, key: str) -> str:
        """Return the text of a key.

        Raises:
            ConfigError: It is missing.
        """
        if key not in self.values:
            raise self.error(f"'{key} = <text>' is missing")
        return self.values[key]

    def array(self, key: str, shape: Index, may_be_unknown: bool = False) -> Array:
        """Return the entries of a key as an array; those that are not given are zero.

        Args:
            key: Which.
            shape: Of the array.
            may_be_unknown: Whether an entry may be NaN.

        Raises:
            ConfigError: An index lies outside of the shape, or a value is no finite number.
        """
        array = np.zeros(shape)
        for (name, index), (text, line) in self.entries.items():
            if name == key:
                if len(index) != len(shape) or any(
                    not 1 <= i <= n for i, n in zip(index, shape, strict=False)
                ):
                    raise self.error(f"{key}{index}: expected indices up to {shape}", line)
                unknown = may_be_unknown and text == "nan"
                array[tuple(i - 1 for i in index)] = np.nan if unknown else self._number(text, line)
        return array

    def taylor(self, n: int, shape: tuple[int, int]) -> Taylor:
        """Return the block as a matrix of a shape over n coordinates.

        Raises:
            ConfigError: It has another shape, or holds what has no place in it.
        """
        found = self.number("nrow"), self.number("ncol")
        if found != shape:
            raise self.error(f"is {found[0]:g} x {found[1]:g}; expected {shape[0]} x {shape[1]}")
        m0 = self.array("m0", shape)
        m1 = self.array("m1", (*shape, n)) if self.whole_number("order", range(2)) else None
        if self.whole_number("structure", _STRUCTURES) == _SYMMETRIC:
            if shape[0] != shape[1]:
                raise self.error(f"structure = {_SYMMETRIC}: is {shape[0]} x {shape[1]}, not symmetric")
            m0, m1 = self._mirrored("m0", m0), None if m1 is None else self._mirrored("m1", m1)
        return Taylor(m0, m1)

    def _mirrored(self, key: str, matrix: Array) -> Array:
        """Complete symmetric matrices (r, r, ...), of which an entry may be given on one side alone."""
        other = matrix.swapaxes(0, 1)
        differ = (matrix != 0) & (other != 0) & (abs(matrix - other) > _SAME * abs(matrix).max(initial=0.0))
        if differ.any():
            at = tuple(np.argwhere(differ)[0])
            place = ", ".join(str(i + 1) for i in at)
            raise self.error(
                f"{key}({place}) = {matrix[at]:g} is not symmetric: mirrored it is {other[at]:g}"
            )
        return np.asarray(np.where(matrix == 0, other, matrix))

    def _number(self, text: str, line: int) -> float:
        try:
            value = float(text.replace("D", "E").replace("d", "e"))
        except ValueError:
            raise self.error(f"'{text}' is not a number", line) from None
        if not math.isfinite(value):
            raise self.error(f"'{text}' is not a finite number", line)
        return value


def parse_blocks(path: Path, lines: Iterable[str]) -> Block:
    """Return the file as one block that holds the others.

    Raises:
        ConfigError: Blocks are not closed in their order, or indices are none.
    """
    stack = [Block(path, 1, "")]
    for number, raw in enumerate(lines, 1):
        line, top = raw.strip(), stack[-1]
        entry = _ENTRY.fullmatch(line)
        if not line or line.startswith(("!", "#")):
            continue
        if line == "end" or line.startswith("end "):
            if len(stack) == 1 or line[4:].split(" ")[0] not in ("", top.name):
                raise top.error(f"'{line}' closes no block", number)
            stack.pop()
        elif entry:
            index = _read_index(entry[2], top, number)
            top.entries[(entry[1], index)] = (entry[3], number)
        elif "=" in line and not line.startswith("new "):
            key, _, value = line.partition("=")
            top.values[key.strip()] = value.strip()
        else:
            name, _, label = line.removeprefix("new ").partition("=")
            stack.append(Block(path, number, name.strip(), label.strip()))
            top.blocks.append(stack[-1])
    if len(stack) > 1:
        raise stack[-1].error(f"is not closed by 'end {stack[-1].name}'")
    return stack[0]


def _read_index(text: str, block: Block, line: int) -> Index:
    if not _INDEX.fullmatch(text):
        raise block.error(f"'{text.strip()}': expected whole numbers between commas as indices", line)
    return tuple(int(i) for i in text.split(","))


def format_taylor(name: str, matrix: Taylor, n: int) -> Iterator[str]:
    """Yield the lines of a matrix over n coordinates."""
    rows, columns = matrix.m0.shape
    order = 0 if matrix.m1 is None else 1
    head = {"order": order, "nrow": rows, "ncol": columns, "nq": n, "nqn": 0, "structure": _FULL}
    body = [f"{key} = {value}" for key, value in head.items()]
    body += format_array("m0", matrix.m0)
    body += [] if matrix.m1 is None else format_array("m1", matrix.m1)
    yield from (name, *(f"  {line}" for line in body), f"end {name}")


def format_array(name: str, array: Array) -> Iterator[str]:
    """Yield a line for every entry of an array that is not (positive) zero."""
    for index in np.argwhere((array != 0) | np.signbit(array)):
        yield f"{name}({', '.join(f'{i + 1:2d}' for i in index)}) = {float(array[tuple(index)])!r}"
