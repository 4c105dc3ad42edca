"""Universal files (.uff, .unv): dataset 58 with responses, coherences or records in time, read by pyuff."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyuff
from numpy.typing import NDArray

from flexarm_bringup.identify.measurement import Cell, Records, Responses, SourceError, checked

Array = NDArray[np.float64]
TIME, RESPONSE, COHERENCE = 1, 4, 6  # function types of dataset 58
# by ordinate data type, per force; strain goes with displacement
KINDS = {3: "receptance", 8: "receptance", 11: "mobility", 12: "accelerance"}
QUANTITIES = {3: "strain", 8: "displacement", 11: "velocity", 12: "acceleration"}
FORCE = 13  # data type of a record that is an input
UNDER = (0, 1, 9, FORCE)  # of what a response is per: unknown, general, reaction force, excitation force
ALLOWED = ", ".join(f"{number} ({name})" for number, name in QUANTITIES.items())
AXES = {1: "+x", 2: "+y", 3: "+z", -1: "-x", -2: "-y", -3: "-z"}


def read_uff(path: Path) -> list[Responses | Records]:
    """Return what a universal file holds: its responses, or a record per run.

    Raises:
        SourceError: It cannot be read, holds no dataset 58 that can be used, or a channel too often.
    """
    try:
        file = pyuff.UFF(str(path))
        types = [int(kind) for kind in file.get_set_types()]
        sets = [file.read_sets(i) for i, kind in enumerate(types) if kind == 58]
    except Exception as error:  # pyuff raises bare exceptions of all kinds
        raise SourceError(f"{path}: not a universal file that can be read: {error}") from error
    if any(item["func_type"] == RESPONSE for item in sets):
        return [_responses(path, sets)]
    if any(item["func_type"] == TIME for item in sets):
        return [*_runs(path, sets)]
    held = ", ".join(map(str, sorted(set(types)))) or "nothing"
    raise SourceError(f"{path}: holds datasets {held}; needed is 58 with responses or records in time")


def _responses(path: Path, sets: Iterable[Mapping[str, Any]]) -> Responses:
    cells: dict[Cell, NDArray[np.complex128]] = {}
    coherence: dict[Cell, Array] = {}
    kinds, lines = set(), None
    for item in sets:
        if item["func_type"] not in (RESPONSE, COHERENCE):
            continue
        x = np.asarray(item["x"], float)
        if lines is not None and (x.shape != lines.shape or not np.allclose(x, lines)):
            raise SourceError(f"{path}: its responses have different lines")
        lines, cell = x, (_point(item, "rsp"), _point(item, "ref"))
        is_coherence = item["func_type"] == COHERENCE
        if cell in (coherence if is_coherence else cells):
            what = "coherence" if is_coherence else "response"
            raise SourceError(
                f"{path}: the {what} {'/'.join(cell)} comes more than once; expected one of each"
            )
        if is_coherence:
            coherence[cell] = np.real(np.asarray(item["data"]))
            continue
        per = int(item.get("orddenom_spec_data_type") or 0)
        if per not in UNDER:
            raise SourceError(
                f"{path}: the response {'/'.join(cell)} is per data type {per}; expected per force ({FORCE})"
            )
        cells[cell] = np.asarray(item["data"], complex)
        kinds.add(_kind(path, item))
    if len(kinds) != 1 or lines is None:
        told = " and ".join(sorted(kinds))
        raise SourceError(f"{path}: its responses are {told}; needed is one of {ALLOWED} for all")
    return checked(path, Responses(lines, cells, coherence, kinds.pop()))


def _runs(path: Path, sets: Iterable[Mapping[str, Any]]) -> list[Records]:
    """Return one record per run, as of five hits: the first of every channel, the second of every one, ..."""
    channels: dict[tuple[bool, str], list[Mapping[str, Any]]] = defaultdict(list)
    for item in sets:
        if item["func_type"] == TIME:
            channels[_is_input(item), _point(item, "rsp")].append(item)
    counts = {f"{'input' if is_input else 'output'} {point}": len(items)
              for (is_input, point), items in channels.items()}  # fmt: skip
    if len(set(counts.values())) != 1:
        told = ", ".join(f"{count} of {name}" for name, count in counts.items())
        raise SourceError(f"{path}: records of its runs: {told}; expected as many of every channel")
    return [_record(path, run) for run in zip(*channels.values(), strict=True)]


def _record(path: Path, sets: Iterable[Mapping[str, Any]]) -> Records:
    inputs: dict[str, Array] = {}
    outputs: dict[str, Array] = {}
    steps, kinds = set(), set()
    for item in sets:
        steps.add(float(item["abscissa_inc"]))
        signals = inputs if _is_input(item) else outputs
        signals[_point(item, "rsp")] = np.real(np.asarray(item["data"]))
        if signals is outputs:
            kinds.add(_kind(path, item))
    if (
        len(steps) != 1
        or len(kinds) != 1
        or len({v.size for v in (*inputs.values(), *outputs.values())}) != 1
    ):
        raise SourceError(f"{path}: its records differ in step, length or kind")
    step = steps.pop()
    if not (np.isfinite(step) and step > 0.0):
        raise SourceError(
            f"{path}: the step in time of its records is {step:g} s; expected evenly spaced "
            "samples, with a step"
        )
    return Records(1.0 / step, inputs, outputs, kinds.pop())


def _kind(path: Path, item: Mapping[str, Any]) -> str:
    """Return what an output is of a displacement; SourceError where its ordinate does not say it."""
    number = int(item["ordinate_spec_data_type"])
    if number not in KINDS:
        name = _point(item, "rsp")
        said = f"output {name} has the ordinate data type {number}"
        raise SourceError(f"{path}: {said}; needed is one of {ALLOWED}")
    return KINDS[number]


def _is_input(item: Mapping[str, Any]) -> bool:
    return int(item["ordinate_spec_data_type"]) == FORCE


def _point(item: Mapping[str, Any], side: str) -> str:
    """Return the name of a point and its direction, "12+z"."""
    return f"{int(item[f'{side}_node'])}{AXES.get(int(item[f'{side}_dir']), '')}"
