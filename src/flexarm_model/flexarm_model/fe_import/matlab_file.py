"""MATLAB files of versions 4 to 7.2, looked over before SciPy reads them.

SciPy trusts what such a file says of itself: where a damaged one names a type that does not exist, or an
entry outside of a sparse matrix, it reads memory that is not its own and the process ends without a word.
Version 5 (to 7.2) is a row of elements: type, number of bytes, content (MAT-File Format, MathWorks, ch. 1).
"""

from __future__ import annotations

import struct
import warnings
import zlib
from pathlib import Path
from typing import Any

from scipy import io, sparse

from flexarm_model.settings.strict_yaml import ConfigError

_HEADER = 128  # bytes of a file of version 5; the last two tell the order of bytes
_HDF = 2  # version 7.3 is another format
_NUMBERS = (1, 2, 3, 4, 5, 6, 7, 9, 12, 13)  # int8 to uint64, single and double
_TEXTS = (16, 17, 18)  # UTF-8, -16, -32
_MATRIX, _COMPRESSED = 14, 15
_DAMAGE = (ValueError, TypeError, LookupError, OverflowError, UnboundLocalError, MemoryError, zlib.error)
_REFUSALS = (*_DAMAGE, NotImplementedError, io.matlab.MatReadError)  # by SciPy, and ours


def read_variables(path: Path) -> dict[str, Any]:
    """Return the variables of a file by name.

    Raises:
        ConfigError: It cannot be read, or is not such a file.
    """
    try:
        content = path.read_bytes()
        version = io.matlab.matfile_version(path)[0]
        if version == _HDF:
            raise ValueError("it is of version 7.3; write it with save(..., '-v7')")
        if version == 1:  # versions 5 to 7.2
            order = "<" if content[_HEADER - 2 : _HEADER] == b"IM" else ">"
            _check(content[_HEADER:], order, (_MATRIX, _COMPRESSED))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # of sparse arrays to come: either is taken
            variables: dict[str, Any] = io.loadmat(path)
        for value in variables.values():
            if sparse.issparse(value) and value.format != "coo":
                value.check_format(full_check=True)
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read ({error.strerror or error})") from None
    except _REFUSALS as error:
        why = str(error) or type(error).__name__
        raise ConfigError(f"{path}: is damaged, or no MATLAB file of version 4 to 7.2: {why}") from None
    return variables


def logical_variables(path: Path) -> set[str]:
    """Return which variables of a file that ``read_variables`` has read are logical: SciPy gives numbers."""
    return {name for name, _, kind in io.whosmat(path) if kind == "logical"}


def _check(elements: bytes, order: str, kinds: tuple[int, ...]) -> None:
    """Refuse elements of another type, or that do not end where they should.

    Raises:
        ValueError: There is one.
    """
    place = 0
    while place < len(elements):
        if place + 8 > len(elements):
            raise ValueError("it is cut short")
        kind, size = struct.unpack_from(f"{order}2I", elements, place)
        start, is_short = place + 8, kind > 0xFFFF
        if is_short:  # type and size share the first word, content is in the second
            kind, size, start = kind & 0xFFFF, kind >> 16, place + 4
        if kind not in kinds or (is_short and size > 4):
            raise ValueError(f"an element has type {kind} and {size} bytes")
        if start + size > len(elements):
            raise ValueError("it is cut short")
        content = elements[start : start + size]
        if kind == _COMPRESSED:
            _check(zlib.decompress(content), order, (_MATRIX,))
        elif kind == _MATRIX:
            _check(content, order, (*_NUMBERS, *_TEXTS, _MATRIX))
        place = start + (4 if is_short else size if kind == _COMPRESSED else -(-size // 8) * 8)
