"""Responses with their fit and what it leaves, coherence, and the complex mode indicator."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.identify.run import Result
from flexarm_bringup.page.figures import Figure, drawing, to_figure
from flexarm_model.modal.cmif import cmif, track_curves
from flexarm_model.modal.frf import Frf

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLUMNS, MOST = 3, 15  # panels in a row and at all
MARK = "#8a7d2f"


def responses_figure(result: Result) -> Figure:
    """Return one panel per output: magnitude by every input, fit, and what the fit leaves."""
    outputs, fitted = result.responses.outputs[:MOST], _fitted(result)
    rows = -(-len(outputs) // COLUMNS)
    with drawing(9.6, 2.15 * rows + 0.3) as plot:
        grid = plot.subplots(rows, min(COLUMNS, len(outputs)), squeeze=False, sharex=True)
        for o, axes in enumerate(grid.flat):
            if o >= len(outputs):
                axes.set_axis_off()
                continue
            _panel(axes, result, fitted, o)
            axes.set_title(outputs[o])
        for axes in grid[-1]:
            axes.set_xlabel("frequency [Hz]")
        count = len(result.responses.outputs)
        many = f" The first {MOST} of {count}." if count > MOST else ""
        inputs = ", ".join(result.responses.inputs)
        caption = (
            f"Magnitude of every output over {inputs} (one colour each), its fit (dashed), and what the fit "
            f"leaves (grey). Faint: lines that were left out for low coherence.{many}"
        )
        return to_figure(plot, caption)


def indicator_figure(result: Result, least: float) -> Figure:
    """Return coherence of every output above, mode indicator below."""
    frf, responses = result.frf, result.responses
    inside = (responses.f_hz >= frf.f_hz[0]) & (responses.f_hz <= frf.f_hz[-1])
    with drawing(9.6, 5.0) as plot:
        above, below = plot.subplots(2, 1, sharex=True, height_ratios=(2, 3))
        for values in {cell[0]: v for cell, v in responses.coherence.items()}.values():
            above.plot(responses.f_hz[inside], values[inside], linewidth=0.8)
        if responses.coherence:
            above.axhline(least, color="#b3261e", linewidth=0.9, linestyle=":")
        else:
            above.text(0.5, 0.5, "not measured", transform=above.transAxes, ha="center", va="center")
        above.set(ylabel="coherence", ylim=(0.0, 1.04))
        size = np.sqrt(np.mean(abs(frf.H) ** 2, axis=(0, 2)))  # outputs of several units
        even = Frf(frf.f_hz, frf.H / np.maximum(size, np.finfo(float).tiny)[:, None], frf.kind)
        curves = track_curves(cmif(even))
        below.semilogy(curves.f_hz, curves.values, linewidth=1.2)
        below.set(
            ylabel="singular values", xlabel="frequency [Hz]", yscale="log" if frf.H.any() else "linear"
        )
        for f in result.found.fit.model.f_hz if result.found.fit else ():
            below.axvline(f, color=MARK, linewidth=0.8)
        caption = (
            "Above: coherence of every output; below the dotted line a line does not count. Below: complex "
            "mode indicator, outputs by their size; several curves high at one line are several modes."
        )
        return to_figure(plot, caption)


def _panel(axes: Axes, result: Result, fitted: NDArray[np.complex128] | None, o: int) -> None:
    frf = result.frf
    counts = result.weight[:, min(o, result.weight.shape[1] - 1)] > 0
    for i in range(frf.H.shape[2]):
        size = abs(frf.H[:, o, i])
        (line,) = axes.semilogy(frf.f_hz, np.where(counts, size, np.nan), linewidth=1.0)
        axes.semilogy(frf.f_hz, size, linewidth=0.7, alpha=0.3, color=line.get_color())
        if fitted is not None:
            axes.semilogy(frf.f_hz, abs(fitted[:, o, i]), "--", linewidth=0.8, color="#010203")
            left = abs(frf.H[:, o, i] - fitted[:, o, i])
            axes.semilogy(frf.f_hz, np.where(counts, left, np.nan), linewidth=0.5, color="#9aa4b0")
    shown = abs(frf.H[:, o])[counts] if counts.any() else abs(frf.H[:, o])
    if shown.any():
        axes.set_ylim(bottom=float(max(shown.min(), 1e-5 * shown.max())) / 30)
    else:  # an output that says nothing
        axes.set_yscale("linear")


def _fitted(result: Result) -> NDArray[np.complex128] | None:
    """Return the fit on the lines, outputs by inputs as measured, (k, n_out, n_in)."""
    if result.found.fit is None:
        return None
    H = result.found.fit.model.frf(result.frf.f_hz).H
    return H.transpose(0, 2, 1) if result.is_reciprocal else H
