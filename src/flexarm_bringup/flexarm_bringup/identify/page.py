"""The page of ``flexarm identify``: modes with plus and minus, responses, mode indicator, chart of orders."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from flexarm_bringup.figures import Figure, drawing, to_figure
from flexarm_bringup.identify.run import Result
from flexarm_bringup.report import Cells, Column, Page, Table
from flexarm_model.modal.cmif import cmif
from flexarm_model.modal.fit import PoleFit

PERCENT = 100.0
NEEDED_LINES = 1.0  # per bandwidth, for a damping that the data hold
WINDOWED_LINES = 6.0  # the same where a window has widened the resonance: below, it reads too high
SHAPES = 12  # modes drawn at most


def build_page(files: Sequence[Path], result: Result, measured: Sequence[Table] = ()) -> Page:
    """Return tables and figures of a result.

    Args:
        files: Where it comes from.
        result: What was identified.
        measured: How it was measured.
    """
    named = ", ".join(path.name for path in files)
    responses, fit = result.responses, result.found.fit
    lead = (
        f"{named}: {len(responses.outputs)} output(s), {len(responses.inputs)} input(s), "
        f"{result.frf.f_hz.size} lines from {result.frf.f_hz[0]:g} to {result.frf.f_hz[-1]:g} Hz, "
        f"{PERCENT * result.weight.mean():.0f} % of them used."
    )
    items: list[Table | Figure] = [_responses(result), _chart(result)]
    if fit:
        items = [_modes(result, fit), _beside(result, fit), *items, _shapes(result, fit)]
    items += measured
    remarks = {"What the data do not hold": _doubts(result)}
    return Page("Modes", lead, items, remarks={k: v for k, v in remarks.items() if v})


def _modes(result: Result, fit: PoleFit) -> Table:
    heads = [
        Column("mode", "d"), Column("frequency\n[Hz]", ".4f"), Column("± [Hz]\nfit", ".4f"),
        Column("± [Hz]\nbootstrap", ".4f"), Column("damping\n[%]", ".3f"), Column("± [%]\nfit", ".3f"),
        Column("± [%]\nbootstrap", ".3f"), Column("lines per\nbandwidth", ".2f"), Column("damping is"),
        Column("real\nshape [%]", ".1f"),
    ]  # fmt: skip
    rows: list[Cells] = []
    for i, (f, zeta) in enumerate(zip(fit.model.f_hz, fit.model.zeta, strict=True)):
        scatter = result.scatter
        known = fit.lines_per_bandwidth[i] >= (WINDOWED_LINES if result.is_windowed else NEEDED_LINES)
        rows.append([
            i + 1, float(f), float(fit.f_std_hz[i]), float(scatter.f_std_hz[i]) if scatter else None,
            PERCENT * float(zeta), PERCENT * float(fit.zeta_std[i]),
            PERCENT * float(scatter.zeta_std[i]) if scatter else None, float(fit.lines_per_bandwidth[i]),
            "known" if known else "not identifiable", PERCENT * _collinearity(_shape(fit, i)),
        ])  # fmt: skip
    notes = [
        f"common poles, fit error {PERCENT * fit.model.error:.2f} % of the responses; ± is one sigma, from "
        "the fit's curvature and, for records, from drawing the blocks again",
        f"with less than a line per bandwidth ({WINDOWED_LINES:g} behind a window) damping rests on the "
        "leakage, and ± tells noise only",
    ]
    return Table("Modes", heads, rows, notes)


def _beside(result: Result, fit: PoleFit) -> Table:
    heads = [
        Column("frequency\n[Hz]", ".4f"), Column("half power\n[Hz]", ".4f"),
        Column("half power\ndamping [%]", ".3f"), Column("one reference,\nchart only [Hz]", ".4f"),
        Column("model\n[Hz]", ".4f"), Column("measured over\nmodel [%]", "+.2f"),
    ]  # fmt: skip
    rows: list[Cells] = []
    for f, simple in zip(fit.model.f_hz, result.half_power, strict=True):
        single, model = (_nearest(values, float(f)) for values in (result.single_hz, result.model_hz))
        rows.append([
            float(f), simple.f_hz if simple else None, PERCENT * simple.zeta if simple else None, single,
            model, PERCENT * (float(f) / model - 1) if model else None,
        ])  # fmt: skip
    return Table("Simpler methods and the model beside", heads, rows)


def _nearest(values: Sequence[float], f_hz: float, within: float = 0.5) -> float | None:
    """Return the value nearest to ``f_hz`` unless it is further off than that share."""
    near = min(values, key=lambda value: abs(value - f_hz), default=None)
    return near if near is not None and abs(near - f_hz) <= within * f_hz else None


def _shape(fit: PoleFit, i: int) -> np.ndarray:
    """Return the shape at the outputs of the fit, largest entry 1, (n_out,)."""
    shape = np.linalg.svd(fit.model.residues[i])[0][:, 0]
    return np.asarray(shape / shape[abs(shape).argmax()])


def _collinearity(shape: np.ndarray) -> float:
    """Return the modal phase collinearity: 1 for a shape whose parts move in phase or against it [1]."""
    parts = np.cov(shape.real, shape.imag, bias=True) if shape.size > 1 else np.diag([1.0, 0.0])
    low, high = np.linalg.eigvalsh(parts)
    return float(((high - low) / (high + low)) ** 2) if high > 0 else 1.0


def _doubts(result: Result) -> list[str]:
    lines = [
        f"{f:.3f} Hz came back at many orders, but the fit does not hold it" for f in result.found.dropped_hz
    ]
    lines += list(result.source.remarks)
    lines += [
        f"{output} is left out: {PERCENT * share:.0f} % of its lines are incoherent"
        for output, share in result.deaf.items()
    ]
    masked = result.weight.size - int(result.weight.sum())
    if masked:
        lines.append(f"{masked} of {result.weight.size} lines of all outputs were left out for low coherence")
    if result.found.fit is None:
        lines.append("no mode stands out of the noise in this band")
    return lines


def _responses(result: Result) -> Figure:
    frf, fit = result.frf, result.found.fit
    with drawing(9.0, 5.2) as plot:
        above, below = plot.subplots(2, 1, sharex=True)
        above.semilogy(frf.f_hz, abs(frf.H).reshape(len(frf.f_hz), -1), linewidth=0.9, alpha=0.6)
        if fit:
            model = fit.model.frf(frf.f_hz).H
            above.semilogy(frf.f_hz, abs(model).reshape(len(frf.f_hz), -1), "k--", linewidth=0.7)
        above.set_ylabel(f"|{frf.kind}|")
        curves = cmif(frf)
        below.semilogy(curves.f_hz, curves.values)
        below.set(ylabel="singular values", xlabel="frequency [Hz]")
        for f in fit.model.f_hz if fit else ():
            below.axvline(f, color="#8a7d2f", linewidth=0.8)
        return to_figure(
            plot, "Above: every response and its fit (dashed). Below: complex mode indicator, modes found."
        )


def _chart(result: Result) -> Figure:
    with drawing(9.0, 3.4) as plot:
        axes = plot.subplots()
        for at_order in result.found.chart:
            f_hz = abs(at_order.poles) / (2 * np.pi)
            axes.plot(f_hz, np.full(f_hz.size, at_order.order), ".", color="#5b6675", markersize=3)
        for track in result.found.chosen:
            axes.plot(
                abs(np.array(track.poles)) / (2 * np.pi), track.orders, ".", color="#d9772b", markersize=5
            )
        axes.set(xlabel="frequency [Hz]", ylabel="order")
        return to_figure(plot, "Stabilisation chart: stable poles of every order; coloured: what lasts.")


def _shapes(result: Result, fit: PoleFit) -> Figure:
    count = min(SHAPES, fit.model.f_hz.size)
    names = result.responses.inputs if result.is_reciprocal else result.responses.outputs
    with drawing(9.0, 1.7 * (-(-count // 4)) + 0.4) as plot:
        grid = plot.subplots(-(-count // 4), 4, squeeze=False, sharey=True)
        for i, axes in enumerate(grid.flat):
            if i >= count:
                axes.set_axis_off()
                continue
            axes.bar(range(len(names)), _shape(fit, i).real)
            axes.set_title(f"{fit.model.f_hz[i]:.3f} Hz")
            axes.set_xticks(range(len(names)), names, rotation=90, fontsize=6)
        return to_figure(plot, "Shapes at the sensors, largest entry one, real part.")
