"""How records are cut into blocks, and what makes responses of them.

Short blocks average much and widen every resonance to the main lobe of their window; long ones average
little. A fifth of the record leaves nine blocks, half of each in the next; more inputs want more of them.
But the chart has so many orders and no more: over many thousand lines it does not see a mode of a few, so of
long records at high rates a block is a sixteenth. Hits and sweeps are taken whole, without a window.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flexarm_bringup.identify.hits import are_hits, rung_down, told_of_hits
from flexarm_bringup.identify.hits_apart import hits_apart
from flexarm_bringup.identify.measurement import Records
from flexarm_bringup.identify.record_checks import LEAST_BLOCK, refuse_unusable
from flexarm_bringup.identify.sweeps import moving_at_end, swept_band
from flexarm_bringup.identify.unlike_inputs import told_of_unlike
from flexarm_model.identification.spectra import BY_INSTRUMENT, SpectrumSettings

BOXCAR = "boxcar"  # the window that is none
LEAST_PARTS = 5  # of a record: a block is at most such a part of it when nobody asks for a resolution
PARTS_PER_INPUT = 4  # of all records together
MANY_PARTS = 16  # of a record whose blocks would have too many lines
MOST_SAMPLES = 6400  # of a block that is more than such a part: 2500 lines of use
MOST_SAMPLES_OF_A_HIT = 25_600  # of a block that is more than what rings
MOST_SAMPLES_OF_A_SWEEP = 60_000  # of a run that is taken whole
SHORTEST = 64  # samples of a block that nobody asked for
SWEPT = "the inputs are sweeps"


@dataclass(frozen=True)
class Averaging:
    """How records become responses.

    Attributes:
        resolution_hz: Distance of the lines [Hz]; None chooses by the length and the number of
            the records and by the number of inputs.
        window: Window of scipy.signal; empty takes none for hits, sweeps and whole periods, else Hann's.
        estimator: One of ``ESTIMATORS`` or "Hc"; empty takes Hc where there are instruments, else H1.
    """

    resolution_hz: float | None = None
    window: str = ""
    estimator: str = ""


@dataclass(frozen=True)
class Cut:
    """How records are cut.

    Attributes:
        settings: Blocks, window and estimator.
        remarks: What the reader should know of it.
        used: Samples at the begin of every run that count; None for all. What follows a hit is noise.
        band_hz: Through which the inputs pass [Hz]; None where they do not pass through one.
        runs: What is cut into blocks where that is not the runs as they came: their hits apart.
        reach: Lines among which one is driven by all hits of a record; 0 where every line counts.
    """

    settings: SpectrumSettings
    remarks: tuple[str, ...] = ()
    used: int | None = None
    band_hz: tuple[float, float] | None = None
    runs: tuple[Records, ...] = ()
    reach: int = 0


def cut_of(records: Sequence[Records], averaging: Averaging) -> Cut:
    """Return how to cut: whole periods where the excitation repeats, whole runs where it is a hit or a sweep.

    Raises:
        SourceError: The runs cannot be cut so, or give no responses.
    """
    first = records[0]
    estimator = averaging.estimator or (BY_INSTRUMENT if first.instruments else "H1")
    if first.repeats:
        refuse_unusable(records, first.repeats)
        return Cut(SpectrumSettings(first.repeats, 0.0, BOXCAR, estimator))
    if are_hits(records):
        return _cut_of_hits(records, averaging, estimator)
    if band_hz := swept_band(records):
        return _cut_of_sweeps(records, averaging, estimator, band_hz)
    settings = _in_blocks(records, averaging, estimator)
    return Cut(settings, told_of_unlike(records) if settings.window != BOXCAR else ())


def _cut_of_hits(records: Sequence[Records], averaging: Averaging, estimator: str) -> Cut:
    """Return how to cut runs whose inputs are hits: without a window unless one was asked for."""
    window, wanted = averaging.window, averaging.resolution_hz
    if window not in ("", BOXCAR):
        settings = _in_blocks(records, averaging, estimator)
        return Cut(settings, tuple(told_of_hits(records, window, settings.block)))
    if wanted:
        block = round(records[0].rate_hz / wanted)
        refuse_unusable(records, block)
        return Cut(
            SpectrumSettings(block, 0.0, BOXCAR, estimator), tuple(told_of_hits(records, window, block))
        )
    refuse_unusable(records, LEAST_BLOCK)
    apart = hits_apart(records)
    block = _block_of_hits(apart.runs)
    reach = -(-block // apart.between) if apart.between else 0
    told = (*told_of_hits(apart.runs, window, block), *filter(None, [apart.told]))
    return Cut(SpectrumSettings(block, 0.0, BOXCAR, estimator), told, block, None, tuple(apart.runs), reach)


def _cut_of_sweeps(
    records: Sequence[Records], averaging: Averaging, estimator: str, band_hz: tuple[float, float]
) -> Cut:
    """Return how to cut runs whose inputs are sweeps: whole where they can be, else as any, with why."""
    whole = _shortest(records)
    unjudged = f"{SWEPT}: no half of a record was predicted from the other, which holds other frequencies"
    if why := _why_in_blocks(records, averaging, whole, band_hz):
        settings = _in_blocks(records, averaging, estimator)
        is_whole = settings.window == BOXCAR and settings.block == whole
        told = f"{SWEPT}, of which blocks give wrong modes or none: {why}"
        return Cut(settings, (unjudged,) if is_whole else (unjudged, told), band_hz=band_hz)
    refuse_unusable(records, whole)
    told = (
        f"{SWEPT} from {band_hz[0]:.3g} to {band_hz[1]:.3g} Hz: runs are taken whole, without a window; each "
        "has to begin at rest"
    )
    return Cut(SpectrumSettings(whole, 0.0, BOXCAR, estimator), (unjudged, told), whole, band_hz)


def _why_in_blocks(
    records: Sequence[Records], averaging: Averaging, whole: int, band_hz: tuple[float, float]
) -> str:
    """Return why sweeps are not taken whole, and what would help; empty where they are."""
    if averaging.resolution_hz or averaging.window not in ("", BOXCAR):
        return "leave --resolution and --window out"
    if len(records) < len(records[0].inputs):
        return (
            f"{len(records)} run(s) taken whole cannot part {len(records[0].inputs)} inputs: sweep each alone"
        )
    options = f"--window boxcar --resolution {records[0].rate_hz / whole:.9g}"
    if moving := moving_at_end(records, band_hz, whole):
        return (
            f"still moving at the end: {', '.join(moving)}; record on until all is at rest, or take runs "
            f"whole where no mode is near the frequency at which they end, {options}"
        )
    if whole > MOST_SAMPLES_OF_A_SWEEP:
        return f"the runs are too long to be taken whole unless in a --band, {options}"
    return ""


def _in_blocks(records: Sequence[Records], averaging: Averaging, estimator: str) -> SpectrumSettings:
    """Return how to average over blocks behind a window."""
    wanted = averaging.resolution_hz
    block = round(records[0].rate_hz / wanted) if wanted else _usual_block(records)
    refuse_unusable(records, block)
    return SpectrumSettings(block, window=averaging.window or "hann", estimator=estimator)


def _shortest(records: Sequence[Records]) -> int:
    """Return the samples of the shortest run."""
    return min(values.size for run in records for values in run.outputs.values())


def _usual_block(records: Sequence[Records]) -> int:
    """Return the samples of a block where nobody asks for a resolution."""
    shortest = _shortest(records)
    parts = max(LEAST_PARTS, PARTS_PER_INPUT * len(records[0].inputs) / len(records))
    few_lines = max(MOST_SAMPLES, shortest / MANY_PARTS)
    return max(SHORTEST, int(min(shortest / parts, few_lines)))


def _block_of_hits(records: Sequence[Records]) -> int:
    """Return the samples of a block of hits: whole runs; of long ones what rings."""
    whole = _shortest(records)
    return min(whole, max(MOST_SAMPLES_OF_A_HIT, rung_down(records)))
