"""Which reader reads which file, and how records become responses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flexarm_bringup.identify.measurement import Records, Responses, SourceError, merge
from flexarm_bringup.identify.table_source import READERS, read_table
from flexarm_bringup.identify.uff_source import read_uff
from flexarm_model.identification.spectra import BlockSpectra, SpectrumSettings, block_spectra
from flexarm_model.modal.frf import KINDS

LINES_PER_RECORD = 1 / 16  # length of a block over that of a record when nobody asks for a resolution
USABLE_BAND = 1 / 2.56  # of the rate; what lies above is spoilt by the anti-aliasing filter

UNIVERSAL = (".uff", ".unv")


@dataclass(frozen=True)
class Averaging:
    """How records become responses.

    Attributes:
        resolution_hz: Distance of the lines [Hz]; None chooses by the length of the record.
        window: Window of scipy.signal.
        estimator: "H1", "H2" or "Hv".
    """

    resolution_hz: float | None = None
    window: str = "hann"
    estimator: str = "H1"


@dataclass(frozen=True)
class Source:
    """Responses, and the blocks that they are averages of where there were records.

    Attributes:
        responses: All cells.
        blocks: Spectra of single blocks; None when the file had responses already.
    """

    responses: Responses
    blocks: BlockSpectra | None = None


def read_sources(paths: Sequence[Path], kind: str, averaging: Averaging) -> Source:
    """Return the responses of all files together: set-ups of one measurement.

    Args:
        paths: Files.
        kind: What an output is of a displacement, where the file does not say.
        averaging: For records.

    Raises:
        SourceError: A file cannot be used, or the files do not fit together.
    """
    if kind not in KINDS:
        raise SourceError(f"kind '{kind}' is not one of {', '.join(KINDS)}")
    parts = [_read(path, kind) for path in paths]
    records = [part for part in parts if isinstance(part, Records)]
    if len(records) not in (0, len(parts)):
        raise SourceError("some files hold responses and some records in time: identify them separately")
    if records:
        return _of_records(records, averaging)
    return Source(merge([part for part in parts if isinstance(part, Responses)]))


def _read(path: Path, kind: str) -> Responses | Records:
    if not path.exists():
        raise SourceError(f"{path}: no such file")
    table: dict[str, Callable[[Path], Responses | Records]] = {
        **dict.fromkeys(UNIVERSAL, read_uff),
        **dict.fromkeys(READERS, lambda path: read_table(path, kind)),
    }
    if path.suffix.lower() not in table:
        raise SourceError(f"{path}: '{path.suffix}' is not one of {', '.join(table)}")
    return table[path.suffix.lower()](path)


def _of_records(records: Sequence[Records], averaging: Averaging) -> Source:
    """Return the responses of runs with the same channels."""
    first = records[0]
    names = (tuple(first.outputs), tuple(first.inputs))
    if any(
        (tuple(run.outputs), tuple(run.inputs)) != names or run.rate_hz != first.rate_hz for run in records
    ):
        raise SourceError("runs differ in channels or rate: give one set-up at a time")
    if not first.inputs:
        raise SourceError("no input was recorded: name it 'in:NAME' (force, torque)")
    shortest = min(values.size for run in records for values in run.outputs.values())
    wanted = averaging.resolution_hz
    block = round(first.rate_hz / wanted) if wanted else max(64, int(shortest * LINES_PER_RECORD))
    settings = SpectrumSettings(block, window=averaging.window, estimator=averaging.estimator)
    try:
        blocks = block_spectra(
            [np.column_stack(list(run.inputs.values())) for run in records],
            [np.column_stack(list(run.outputs.values())) for run in records],
            first.rate_hz,
            settings,
        )
        measured = blocks.frf(averaging.estimator, first.kind)
    except ValueError as error:
        raise SourceError(str(error)) from error
    usable = measured.frf.f_hz <= USABLE_BAND * first.rate_hz
    cells = {
        (o, i): measured.frf.H[usable, k, m] for k, o in enumerate(names[0]) for m, i in enumerate(names[1])
    }
    coherence = {(o, i): measured.coherence[usable, k] for k, o in enumerate(names[0]) for i in names[1]}
    return Source(Responses(measured.frf.f_hz[usable], cells, coherence, first.kind), blocks)
