"""The text of standard input data [Wallrapp1994]: nested blocks of keys and of entries with indices.

::

    new modal                        a block; "new" may be missing
      mdCM                           another one inside
        nrow = 3                     a key
        m0( 1, 1) = 0.25             an entry; those that are not given are zero
      end mdCM
    end modal               ! a comment

A comment begins with ``!`` or ``#`` where a line or a word begins; inside a word, or between double quotes
about a text, both are part of it. Between words stand any blanks. Nothing may be given twice. Numbers are
written so that they read back bit for bit.
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

_QUOTED_OR_COMMENT = re.compile(r'("[^"]*")|(?:^|(?<=\s))[!#].*')
_NEW = re.compile(r"new\s+")
_ENTRY = re.compile(r"(\w+)\s*\((.*?)\)\s*=\s*(.*)")
_INDEX = re.compile(r"\s*\d{1,9}\s*(,\s*\d{1,9}\s*)*")


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

    def add_entry(self, name: str, index: Index, text: str, line: int) -> None:
        """Take an entry of a line.

        Raises:
            ConfigError: It was given before.
        """
        if (name, index) in self.entries:
            raise self.error(f"{name}{index} is given twice", line)
        self.entries[(name, index)] = text, line

    def add_value(self, key: str, text: str, line: int) -> None:
        """Take the value of a key in a line.

        Raises:
            ConfigError: It was given before.
        """
        if key in self.values:
            raise self.error(f"'{key}' is given twice", line)
        self.values[key] = text

    def add_block(self, name: str, label: str, line: int) -> Block:
        """Begin a block inside in a line.

        Raises:
            ConfigError: There is one of that name and label.
        """
        inner = Block(self.path, line, name, label)
        if any((name, label) == (other.name, other.label) for other in self.blocks):
            raise inner.error(f"is given twice{f', {label}' if label else ''}")
        self.blocks.append(inner)
        return inner

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
        ConfigError: Blocks are not closed in their order, indices are none, or something is given twice.
    """
    stack = [Block(path, 1, "")]
    for number, raw in enumerate(lines, 1):
        line, top = _without_comment(raw), stack[-1]
        words, entry, new = line.split(), _ENTRY.fullmatch(line), _NEW.match(line)
        if not words:
            continue
        if words[0] == "end":
            if len(stack) == 1 or words[1:2] not in ([], [top.name]):
                raise top.error(f"'{line}' closes no block", number)
            stack.pop()
        elif entry:
            top.add_entry(entry[1], _read_index(entry[2], top, number), entry[3], number)
        elif "=" in line and not new:
            key, _, value = line.partition("=")
            top.add_value(key.strip(), _unquoted(value), number)
        else:
            name, _, label = line[new.end() if new else 0 :].partition("=")
            stack.append(top.add_block(name.strip(), _unquoted(label), number))
    if len(stack) > 1:
        raise stack[-1].error(f"is not closed by 'end {stack[-1].name}'")
    return stack[0]


def format_text(text: str) -> str:
    """Return a text as it reads back: between quotes where it holds what begins a comment.

    Raises:
        ConfigError: It would need quotes and holds one.
    """
    if _without_comment(text) == text and not text.startswith('"'):
        return text
    if '"' in text:
        raise ConfigError(f"name '{text}': cannot be written; expected one without a double quote")
    return f'"{text}"'


def _without_comment(line: str) -> str:
    return _QUOTED_OR_COMMENT.sub(lambda found: found[1] or "", line).strip()


def _unquoted(text: str) -> str:
    plain = text.strip()
    return plain[1:-1] if len(plain) > 1 and plain[0] == plain[-1] == '"' else plain


def _read_index(text: str, block: Block, line: int) -> Index:
    if not _INDEX.fullmatch(text):
        raise block.error(f"'{text.strip()}': expected whole numbers between commas as indices", line)
    return tuple(int(i) for i in text.split(","))


def format_array(name: str, array: Array) -> Iterator[str]:
    """Yield a line for every entry of an array that is not (positive) zero."""
    for index in np.argwhere((array != 0) | np.signbit(array)):
        yield f"{name}({', '.join(f'{i + 1:2d}' for i in index)}) = {float(array[tuple(index)])!r}"
