"""Half of the records predicts the other half: modes of the first halves, judged on the second."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.identify.averaging import Averaging
from flexarm_bringup.identify.hits import are_hits
from flexarm_bringup.identify.measurement import Records, SourceError
from flexarm_bringup.identify.run import Request, identify
from flexarm_bringup.identify.sources import Source, of_records
from flexarm_bringup.identify.sweeps import swept_band
from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import Cells, Column, Page, Table
from flexarm_model.identification.half_prediction import HalfFit, Halved, predict_half

Array = NDArray[np.float64]
BELOW, ABOVE = 0.5, 1.2  # ends of the band judged, of the slowest and fastest mode: no drift, no faster modes


@dataclass(frozen=True)
class Halves:
    """How well the second halves were predicted.

    Attributes:
        outputs: Names.
        f_hz: Modes of the first halves [Hz], (r,).
        fit: Of every output.
    """

    outputs: tuple[str, ...]
    f_hz: tuple[float, ...]
    fit: HalfFit


def judge_halves(source: Source, request: Request, averaging: Averaging) -> Halves | None:
    """Identify the first halves of the records and predict the second; None where there are no records.

    A record that is too short to be halved, whose first half shows no mode, or whose input is a hit or a
    sweep, says nothing: None, too.
    """
    if not source.records or are_hits(source.records):
        return None
    if not source.records[0].repeats and swept_band(source.records):
        return None
    firsts = [first_half(record) for record in source.records]
    try:
        result = identify(replace(of_records(firsts, averaging), draw=None), request)
    except (SourceError, ValueError):
        return None
    if result.found.fit is None:
        return None
    model, names = result.found.fit.model, result.responses.outputs
    low, high = result.band_hz
    band = max(low, BELOW * float(model.f_hz[0])), min(high, ABOVE * float(model.f_hz[-1]))
    halved = [_halved(record, names, band) for record in source.records]
    return Halves(names, tuple(map(float, model.f_hz)), predict_half(model.poles, halved))


def first_half(record: Records) -> Records:
    """Return the first half, of whole periods where the excitation repeats."""
    n = next(iter(record.outputs.values())).size // 2
    if record.repeats:
        n = max(n // record.repeats, 1) * record.repeats

    def cut(signals: Mapping[str, Array]) -> dict[str, Array]:
        """Return the first half of all signals."""
        return {name: values[:n] for name, values in signals.items()}

    return replace(
        record,
        inputs=cut(record.inputs),
        outputs=cut(record.outputs),
        instruments=cut(record.instruments),
    )


def with_halves(page: Page, halves: Halves | None) -> Page:
    """Return the page with the judgement."""
    if halves is None:
        return page
    fit = halves.fit
    heads = [
        Column("output"),
        Column("first half,\nfitted [%]", ".1f"),
        Column("second half,\npredicted [%]", ".1f"),
    ]
    rows: list[Cells] = [
        [name, float(first), float(second)]
        for name, first, second in zip(halves.outputs, fit.first, fit.second, strict=True)
    ]
    modes = ", ".join(f"{f:.3f}" for f in halves.f_hz)
    notes = [
        f"modes of the first half: {modes} Hz; fit = 100 (1 - |y - predicted| / |y - mean|) in their band",
        "refused are modes that grow, and models that leave half as much again in the second half",
    ]
    check = Check("half of the record predicts the other", "no growing mode, not overfitted",
                  fit.refusal or "kept", not fit.refusal)  # fmt: skip
    items = [*page.items, Table("Half of the record predicts the other half", heads, rows, notes)]
    return Page(page.title, page.lead, items, [*page.checks, check], page.remarks, page.data)


def _halved(record: Records, names: tuple[str, ...], band_hz: tuple[float, float]) -> Halved:
    u = np.column_stack(list(record.inputs.values()))
    y = np.column_stack([_filled(record.outputs[name]) for name in names])
    return Halved(u, y, 1.0 / record.rate_hz, record.is_held, band_hz)


def _filled(values: Array) -> Array:
    """Return samples with a straight line where some are missing."""
    known = np.isfinite(values)
    at = np.arange(values.size)
    return np.asarray(np.interp(at, at[known], values[known])) if known.any() else np.zeros_like(values)
