"""How records are cut into blocks, and what makes responses of them.

Short blocks average much and widen every resonance to the main lobe of their window; long ones average
little. A fifth of the record leaves nine blocks, half of each in the next; more inputs want more of them.
But the chart has so many orders and no more: over many thousand lines it does not see a mode of a few, so of
long records at high rates a block is a sixteenth.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flexarm_bringup.identify.hits import are_hits, rung_down, told_of_hits
from flexarm_bringup.identify.measurement import Records
from flexarm_bringup.identify.record_checks import refuse_unusable
from flexarm_model.identification.spectra import BY_INSTRUMENT, SpectrumSettings

BOXCAR = "boxcar"  # the window that is none
LEAST_PARTS = 5  # of a record: a block is at most such a part of it when nobody asks for a resolution
PARTS_PER_INPUT = 4  # of all records together
MANY_PARTS = 16  # of a record whose blocks would have too many lines
MOST_SAMPLES = 6400  # of a block that is more than such a part: 2500 lines of use
MOST_SAMPLES_OF_A_HIT = 25_600  # of a block that is more than what rings
SHORTEST = 64  # samples of a block that nobody asked for


@dataclass(frozen=True)
class Averaging:
    """How records become responses.

    Attributes:
        resolution_hz: Distance of the lines [Hz]; None chooses by the length and the number of
            the records and by the number of inputs.
        window: Window of scipy.signal; empty takes none for hits and whole periods, else Hann's.
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
    """

    settings: SpectrumSettings
    remarks: tuple[str, ...] = ()
    used: int | None = None


def cut_of(records: Sequence[Records], averaging: Averaging) -> Cut:
    """Return how to cut: whole periods where the excitation repeats, whole runs where it is a hit.

    Raises:
        SourceError: The runs cannot be cut so, or give no responses.
    """
    first = records[0]
    estimator = averaging.estimator or (BY_INSTRUMENT if first.instruments else "H1")
    if first.repeats:
        refuse_unusable(records, first.repeats)
        return Cut(SpectrumSettings(first.repeats, 0.0, BOXCAR, estimator))
    hits = are_hits(records)
    whole = hits and averaging.window in ("", BOXCAR)
    wanted = averaging.resolution_hz
    usual = _block_of_hits if whole else _usual_block
    block = round(first.rate_hz / wanted) if wanted else usual(records)
    refuse_unusable(records, block)
    told = tuple(told_of_hits(records, averaging.window, block)) if hits else ()
    if whole:
        return Cut(SpectrumSettings(block, 0.0, BOXCAR, estimator), told, None if wanted else block)
    return Cut(SpectrumSettings(block, window=averaging.window or "hann", estimator=estimator), told)


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
