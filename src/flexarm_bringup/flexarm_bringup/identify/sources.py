"""Which reader reads which file, and how records become responses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.identify.averaging import BOXCAR, Averaging, cut_of
from flexarm_bringup.identify.bag_source import read_bag
from flexarm_bringup.identify.measurement import Records, Responses, SourceError, merge
from flexarm_bringup.identify.record_checks import in_order_of, without_outputs
from flexarm_bringup.identify.set_ups import check_scale
from flexarm_bringup.identify.table_source import READERS, read_table
from flexarm_bringup.identify.uff_source import read_uff
from flexarm_bringup.identify.undriven_lines import undriven_lines, without_lines
from flexarm_model.identification.bootstrap import FEWEST_BLOCKS
from flexarm_model.identification.doubles import main_lobe
from flexarm_model.identification.spectra import BY_INSTRUMENT, MeasuredFrf, block_spectra
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.modal.frf import KINDS

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
DRAWS_TRIED = 20  # until all inputs can be told apart
USABLE_BAND = 1 / 2.56  # of the rate; what lies above is spoilt by the anti-aliasing filter

UNDER_FEEDBACK = (
    "the torque answers to the sensors: without an instrument H1 mixes arm and controller where the arm was "
    "hardly excited; excite it, or compare with --output-only"
)
UNIVERSAL = (".uff", ".unv")


@dataclass(frozen=True)
class Source:
    """Responses, and the blocks that they are averages of where there were records.

    Attributes:
        responses: All cells.
        draw: Makes responses from blocks drawn with repetition; None when there are no blocks to draw from.
        estimator: Which made the responses from records; empty when the file had responses already.
        lobe_lines: Width of the main lobe of the window behind which blocks were cut [lines]; 0 without one.
        remarks: What the reader should know of it.
        records: What the responses were made of, where there were records of one set-up.
        rate_hz: Samples per second of the records; 0 without any, or where they differ [Hz].
        set_ups: The runs of every set-up, channels in one order; empty where there were responses.
    """

    responses: Responses
    draw: Callable[[np.random.Generator], Responses] | None = None
    estimator: str = ""
    lobe_lines: float = 0.0
    remarks: tuple[str, ...] = ()
    records: tuple[Records, ...] = ()
    rate_hz: float = 0.0
    set_ups: tuple[tuple[Records, ...], ...] = ()


def read_sources(
    paths: Sequence[Path],
    kind: str,
    averaging: Averaging,
    ignore: Sequence[str] = (),
    arm: ManipulatorConfig | None = None,
    *,
    must_have: bool = True,
) -> Source:
    """Return the responses of all files together: set-ups of one measurement.

    Args:
        paths: Files.
        kind: What an output is of a displacement, where the file does not say.
        averaging: For records.
        ignore: Outputs of records to leave out before anything is made of them.
        arm: The manipulator of bags that do not say theirs.
        must_have: An output to leave out that is in no file is refused.

    Raises:
        SourceError: A file cannot be used, or the files do not fit together.
    """
    if kind not in KINDS:
        raise SourceError(f"kind '{kind}' is not one of {', '.join(KINDS)}")
    parts = [part for path in paths for part in _read(path, kind, arm)]
    records = [part for part in parts if isinstance(part, Records)]
    if len(records) not in (0, len(parts)):
        raise SourceError("some files hold responses and some records in time: identify them separately")
    if records:
        return of_records(without_outputs(records, ignore, () if must_have else ignore), averaging)
    responses = [part for part in parts if isinstance(part, Responses)]
    return Source(merge(responses), remarks=check_scale(responses))


def read_records(paths: Sequence[Path], kind: str, arm: ManipulatorConfig | None = None) -> list[Records]:
    """Return the records of files, whatever their channels; ``arm`` is that of bags that do not say theirs.

    Raises:
        SourceError: A file cannot be used, or holds responses.
    """
    records: list[Records] = []
    for path in paths:
        parts = _read(path, kind, arm)
        records += [part for part in parts if isinstance(part, Records)]
        if any(isinstance(part, Responses) for part in parts):
            raise SourceError(f"{path}: holds responses; needed are records in time")
    return records


def _read(path: Path, kind: str, arm: ManipulatorConfig | None) -> list[Responses | Records]:
    """Return what a file or the folder of a bag holds: responses, or one or more runs."""
    return [
        replace(part, file=path.name) if isinstance(part, Records) else part
        for part in _parts(path, kind, arm)
    ]


def _parts(path: Path, kind: str, arm: ManipulatorConfig | None) -> list[Responses | Records]:
    """Return the same as its reader gives it."""
    if not path.exists():
        raise SourceError(f"{path}: no such file")
    if path.is_dir():
        return [read_bag(path, otherwise=arm)]
    table: dict[str, Callable[[Path], list[Responses | Records]]] = {
        **dict.fromkeys(UNIVERSAL, read_uff),
        **dict.fromkeys(READERS, lambda path: [read_table(path, kind)]),
    }
    if path.suffix.lower() not in table:
        raise SourceError(
            f"{path}: '{path.suffix}' is not one of {', '.join(table)}, nor the folder of a bag"
        )
    return table[path.suffix.lower()](path)


def of_records(records: Sequence[Records], averaging: Averaging) -> Source:
    """Return the responses of runs; runs with other channels are other set-ups of the same test.

    Channels go by their names; in which order a file has them is of no account.

    Raises:
        SourceError: They do not fit together, have no input, or are too short.
    """
    groups: dict[tuple[frozenset[str], frozenset[str]], list[Records]] = {}
    for run in records:
        group = groups.setdefault((frozenset(run.outputs), frozenset(run.inputs)), [])
        group.append(in_order_of(group[0], run) if group else run)
    sources = [_of_set_up(group, averaging) for group in groups.values()]
    if len(sources) == 1:
        return sources[0]
    parts, draws = [source.responses for source in sources], [source.draw for source in sources]

    def draw(rng: np.random.Generator) -> Responses:
        """Draw from each of the sources."""
        return merge([again(rng) for again in draws if again is not None])

    unjudged = "several set-ups: no half of a record was predicted from the other"
    told = (
        *check_scale(parts),
        unjudged,
        *dict.fromkeys(remark for source in sources for remark in source.remarks),
    )
    return Source(
        merge(parts),
        None if None in draws else draw,
        sources[0].estimator,
        max(source.lobe_lines for source in sources),
        told,
        rate_hz=sources[0].rate_hz if len({source.rate_hz for source in sources}) == 1 else 0.0,
        set_ups=tuple(runs for source in sources for runs in source.set_ups),
    )


def _of_set_up(records: Sequence[Records], averaging: Averaging) -> Source:
    """Return the responses of runs with the same channels."""
    first = records[0]
    if not first.inputs:
        raise SourceError("no input was recorded: name it 'in:NAME' (force, torque), or try --output-only")
    try:
        cut = cut_of(records, averaging)
        settings, estimator = cut.settings, cut.settings.estimator
        runs = cut.runs or records
        first = replace(first, band_hz=first.band_hz or cut.band_hz)
        blocks = block_spectra(
            [np.column_stack(list(run.inputs.values()))[: cut.used] for run in runs],
            [np.column_stack(list(run.outputs.values()))[: cut.used] for run in runs],
            first.rate_hz,
            settings,
            [r[: cut.used] for r in _instruments(runs)],
        )
        undriven = undriven_lines(blocks, cut.reach)
        responses = _responses(without_lines(blocks.frf(estimator, first.kind), undriven), first)
    except ValueError as error:
        raise SourceError(str(error)) from error
    count = len(blocks.spectra)

    def draw(rng: np.random.Generator) -> Responses:
        """Draw blocks with repetition."""
        for _ in range(DRAWS_TRIED):  # few blocks drawn with repetition may hold too few inputs
            try:
                drawn = blocks.frf(estimator, first.kind, rng.integers(count, size=count))
                return _responses(without_lines(drawn, undriven), first)
            except ValueError:
                continue
        return responses

    few = () if count >= FEWEST_BLOCKS else (f"{count} block(s): too few to draw again, so no bootstrap",)
    is_fed_back = any(run.is_of_moves or run.instruments for run in records)
    fed_back = (UNDER_FEEDBACK,) if is_fed_back and estimator != BY_INSTRUMENT else ()
    lobe = main_lobe(settings.window) if settings.window != BOXCAR else 0.0
    own = dict.fromkeys(remark for run in records for remark in run.remarks)
    told = (*few, *cut.remarks, *fed_back, *own)
    return Source(
        responses, None if few else draw, estimator, lobe, told, tuple(records), first.rate_hz,
        (tuple(records),),
    )  # fmt: skip


def _responses(measured: MeasuredFrf, like: Records) -> Responses:
    """Return the usable lines by name; what holding the inputs does to them is taken out."""
    usable = measured.frf.f_hz <= USABLE_BAND * like.rate_hz
    f_hz, H = measured.frf.f_hz[usable], measured.frf.H[usable]
    if like.is_held:
        H = H / hold_response(f_hz, like.rate_hz)[:, None, None]
    cells = {(o, i): H[:, k, m] for k, o in enumerate(like.outputs) for m, i in enumerate(like.inputs)}
    coherence = {
        (o, i): measured.coherence[usable, k] for k, o in enumerate(like.outputs) for i in like.inputs
    }
    return Responses(f_hz, cells, coherence, like.kind, like.kinds, like.band_hz)


def hold_response(f_hz: Array, rate_hz: float) -> Complex:
    """Return what holding samples does to a spectrum, ``(1 - exp(-s dt)) / (s dt)``, (k,)."""
    turned = f_hz / rate_hz
    return np.asarray(np.sinc(turned) * np.exp(-1j * np.pi * turned))


def _instruments(records: Sequence[Records]) -> list[Array]:
    if not all(tuple(run.instruments) == tuple(run.inputs) for run in records):
        return []
    return [np.column_stack(list(run.instruments.values())) for run in records]
