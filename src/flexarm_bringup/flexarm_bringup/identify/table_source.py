"""Tables: CSV with a header (``csv_table``), MATLAB .mat and NumPy .npz with the same names.

Responses: a column ``f_hz`` and per response ``OUTPUT/INPUT.re`` and ``OUTPUT/INPUT.im`` (or one complex
``OUTPUT/INPUT``), its coherence ``OUTPUT/INPUT.coherence`` if known. Records: a column ``t`` [s], inputs
``in:NAME``, outputs ``out:NAME``; ``is_held`` is 1 where an input stays until the next sample (in a CSV in
every line), otherwise it is that at the sample. MATLAB allows neither "/" nor ":": write ``OUTPUT__INPUT``,
``in_NAME``.
"""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.identify.csv_table import read_csv
from flexarm_bringup.identify.even_time import rate_of
from flexarm_bringup.identify.measurement import COMMON, Cell, Records, Responses, SourceError, checked
from flexarm_model.fe_import.matlab_file import read_variables
from flexarm_model.modal.frf import KINDS
from flexarm_model.settings.strict_yaml import ConfigError

Array = NDArray[np.float64]
SIDES = ("in:", "out:", "ref:")
NUMBERS = "biufc"  # kinds of NumPy's types
LEAST_PERIOD = 4  # samples after which an excitation repeats


def read_table(path: Path, kind: str) -> Responses | Records:
    """Return what a table holds; its outputs are ``kind`` of a displacement.

    Raises:
        SourceError: It cannot be read, or columns are missing, doubled, unlike in length or no numbers.
    """
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise SourceError(f"{path}: '{path.suffix}' is not one of {', '.join(READERS)}")
    try:
        columns = reader(path)
    except ConfigError as error:  # names the file
        raise SourceError(str(error)) from error
    except (OSError, EOFError, ValueError, KeyError, NotImplementedError, zipfile.BadZipFile) as error:
        raise SourceError(f"{path}: cannot be read: {error}") from error
    if "f_hz" in columns:
        _refuse_other_columns(path, columns, "f_hz")
        return _responses(path, columns, kind)
    if "t" in columns:
        _refuse_other_columns(path, columns, "t")
        return _records(path, columns, kind)
    named = ", ".join(list(columns)[:8])
    raise SourceError(f"{path}: columns {named}; needed is 'f_hz' for responses or 't' for records in time")


def _refuse_other_columns(path: Path, columns: Mapping[str, Any], first: str) -> None:
    """Refuse columns that are not one number per line or sample, a real one but of whole responses."""
    rows = np.shape(columns[first])
    for name, values in columns.items():
        if not _is_column(name):
            continue
        shape, dtype = np.shape(values), np.asarray(values).dtype
        if not (len(shape) == 1 and shape == rows):
            raise SourceError(
                f"{path}: '{name}' has the shape {shape}, '{first}' {rows}; expected columns alike"
            )
        if dtype.kind not in NUMBERS:
            raise SourceError(f"{path}: '{name}' holds {dtype.name}; expected numbers")
        if np.imag(values).any() and not _is_whole_response(name):
            raise SourceError(
                f"{path}: '{name}' holds complex numbers; expected real ones: complex ones go into a column "
                "OUTPUT/INPUT without .re and .im"
            )


def _is_column(name: str) -> bool:
    return name in ("t", "f_hz") or "/" in name or name.startswith(SIDES)


def _is_whole_response(name: str) -> bool:
    return "/" in name and "." not in name.partition("/")[2]


def _read_csv(path: Path) -> dict[str, Any]:
    """Return the columns; one that is no channel and has the same number in every line is that number."""
    return {
        name: values[:1] if not _is_column(name) and (values == values[0]).all() else values
        for name, values in read_csv(path).items()
    }


def _read_mat(path: Path) -> dict[str, Any]:
    found = {
        _from_matlab(name): np.squeeze(value)
        for name, value in read_variables(path).items()
        if not name.startswith("__")
    }
    return {name: np.atleast_1d(value) if _is_column(name) else value for name, value in found.items()}


def _from_matlab(name: str) -> str:
    for prefix in ("in_", "out_", "ref_", "kind_"):
        if name.startswith(prefix):
            return f"{prefix[:-1]}:{name.removeprefix(prefix)}"
    return name.replace("__", "/").replace("_coherence", ".coherence")


def _read_npz(path: Path) -> dict[str, Any]:
    loaded = np.load(path)
    if isinstance(loaded, np.ndarray):
        raise ValueError("one array without a name; expected an archive of np.savez")
    with loaded as file:
        return {name: file[name] for name in file.files}


READERS = {".csv": _read_csv, ".mat": _read_mat, ".npz": _read_npz}


def _responses(path: Path, columns: Mapping[str, Any], kind: str) -> Responses:
    cells: dict[Cell, NDArray[np.complex128]] = {}
    coherence: dict[Cell, Array] = {}
    for name, values in columns.items():
        output, _, rest = name.partition("/")
        entry, _, part = rest.rpartition(".") if "." in rest else (rest, "", "")
        whole = {f"{output}/{entry}.re", f"{output}/{entry}.im"} <= set(columns)
        if name == "f_hz" or (part == "im" and whole):
            continue
        if not entry:
            raise SourceError(f"{path}: column '{name}' is not OUTPUT/INPUT")
        if part == "coherence":
            coherence[output, entry] = np.real(np.asarray(values))
        elif part == "re" and whole:
            cells[output, entry] = np.real(values) + 1j * np.real(columns[f"{output}/{entry}.im"])
        elif not part:
            cells[output, entry] = np.asarray(values, complex)
        else:
            raise SourceError(f"{path}: column '{name}' must end in .re, .im or .coherence, with both parts")
    if not cells:
        raise SourceError(f"{path}: no column OUTPUT/INPUT beside f_hz")
    return checked(path, Responses(np.real(np.asarray(columns["f_hz"])), cells, coherence, kind))


def _records(path: Path, columns: Mapping[str, Any], kind: str) -> Records:
    t = np.real(np.asarray(columns["t"]))
    rate_hz = rate_of(path, t)
    sides: dict[str, dict[str, Array]] = {"in": {}, "out": {}, "ref": {}}
    for name, values in columns.items():
        side, colon, channel = name.partition(":")
        if side in sides and colon:
            sides[side][channel] = np.real(np.asarray(values))
    if not sides["out"]:
        raise SourceError(f"{path}: no output: name columns 'out:NAME' and 'in:NAME'")
    instruments = _instruments(path, sides["in"], sides["ref"])
    kinds = _kinds(path, columns)
    if set(kinds) >= set(sides["out"]):
        kind = COMMON
    kinds = {name: value for name, value in kinds.items() if value != kind}
    return Records(
        rate_hz, sides["in"], sides["out"], kind, kinds, instruments,
        _repeats(path, columns, t.size), bool(_number(path, columns, "is_held")), _band(path, columns),
        is_centred=bool(_number(path, columns, "is_centred")),
    )  # fmt: skip


def _kinds(path: Path, columns: Mapping[str, Any]) -> dict[str, str]:
    """Return what single outputs are of a displacement, by their names."""
    kinds = {name[5:]: values for name, values in columns.items() if name.startswith("kind:")}
    for name, values in kinds.items():
        if np.size(values) != 1 or str(np.squeeze(values)) not in KINDS:
            told = (
                f"has the shape {np.shape(values)}" if np.size(values) != 1 else f"is '{np.squeeze(values)}'"
            )
            raise SourceError(f"{path}: 'kind:{name}' {told}; expected one of {', '.join(KINDS)}")
    return {name: str(np.squeeze(values)) for name, values in kinds.items()}


def _repeats(path: Path, columns: Mapping[str, Any], samples: int) -> int:
    """Return after how many samples the excitation repeats; 0 when it does not."""
    repeats = _number(path, columns, "repeats")
    if repeats != int(repeats) or not (repeats == 0 or LEAST_PERIOD <= repeats <= samples):
        raise SourceError(
            f"{path}: 'repeats' is {repeats:.15g}; expected 0, or {LEAST_PERIOD} to the {samples} samples"
        )
    return int(repeats)


def _number(path: Path, columns: Mapping[str, Any], name: str) -> float:
    """Return the one number that an entry holds; 0 where there is no such entry."""
    value = np.asarray(columns.get(name, 0))
    if value.size != 1 or value.dtype.kind not in NUMBERS or not np.isfinite(value).all():
        told = f"has the shape {value.shape}" if value.size != 1 else f"is {value.item()!r}"
        raise SourceError(f"{path}: '{name}' {told}; expected one number")
    return float(np.real(value).item())


def _instruments(path: Path, inputs: Mapping[str, Array], asked: Mapping[str, Array]) -> dict[str, Array]:
    """Return what was asked of the inputs, in their order; of all or of none."""
    if asked and set(asked) != set(inputs):
        raise SourceError(
            f"{path}: 'ref:' of {', '.join(asked)}, 'in:' of {', '.join(inputs) or 'none'}; "
            "expected the same names"
        )
    return {name: asked[name] for name in inputs if name in asked}


def _band(path: Path, columns: Mapping[str, Any]) -> tuple[float, float] | None:
    if "band_hz" not in columns:
        return None
    band = np.atleast_1d(np.real(columns["band_hz"]))
    if band.shape != (2,) or not 0.0 <= band[0] < band[1]:
        raise SourceError(f"{path}: 'band_hz' is {band.tolist()}; expected its lower and its upper end [Hz]")
    return float(band[0]), float(band[1])
