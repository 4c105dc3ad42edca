"""The page of ``flexarm identify``: modes with plus and minus, responses, mode indicator, chart of orders."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from flexarm_bringup.identify.chart_figure import chart_figure
from flexarm_bringup.identify.likeness_figure import likeness_figure
from flexarm_bringup.identify.response_figures import indicator_figure, responses_figure
from flexarm_bringup.identify.run import WINDOWED_LINES, Result
from flexarm_bringup.identify.shapes_figure import shapes_figure
from flexarm_bringup.page.check import Check
from flexarm_bringup.page.figures import Figure
from flexarm_bringup.page.report import Cells, Column, Page, Table
from flexarm_model.identification.held_modes import all_together
from flexarm_model.modal.fit import PoleFit
from flexarm_model.modal.frf import KINDS

PERCENT = 100.0
MOVES = {"accelerance": "acceleration", "mobility": "velocity"}
MANY_LINES = 5000  # over which the chart's orders hardly show a mode of a few lines
MOST_LEFT = 20.0  # of the responses, beyond which the modes are not what was measured [%]
KNOWN = 0.1  # sigma of a damping over it, up to which it is known
NOTHING = Check("modes that stand out of the noise in this band", "one at least", "none", False)
PERHAPS = "of a faster mode?"  # a pole that a mode above half the rate explains best
UNEXCITED = (
    "nobody excited the arm on purpose, and smooth moves hardly reach its modes: do a modal test, flexarm "
    "identify rig --nodes join --manipulator NAME, while no controller is active, or look with --output-only "
    "for what rings by itself"
)
SHADOW = "of no mode?"  # a pole that no linear arm has


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
    figures = [responses_figure(result), indicator_figure(result, result.least_coherence)]
    chosen = fit.model.f_hz if fit else np.zeros(0)
    items: list[Table | Figure] = [*figures, chart_figure(result.found.chart, chosen)]
    if fit:
        shapes = np.array([_shape(result, i) for i in range(chosen.size)])
        moving = shapes_figure(chosen, fit.model.zeta, shapes, *_sensors(result))
        items = [
            _modes(result, fit), _beside(result, fit), moving, *items, likeness_figure(chosen, shapes),
            _sources(result, fit),
        ]  # fmt: skip
    items += measured
    remarks = {"What the data do not hold": _doubts(result)}
    left = "what the modes leave of the responses"
    checks = [Check.at_most(left, PERCENT * fit.model.error, MOST_LEFT, "%")] if fit else [NOTHING]
    return Page("Modes", lead, items, checks, {k: v for k, v in remarks.items() if v})


def _modes(result: Result, fit: PoleFit) -> Table:
    heads = [
        Column("mode", "d"), Column("frequency\n[Hz]", ".4f"), Column("±\n[Hz]", ".4f"),
        Column("damping\n[%]", ".3f"), Column("±\n[%]", ".3f"), Column("lines per\nbandwidth", ".2f"),
        Column("damping is"), Column("real\nshape [%]", ".1f"),
    ]  # fmt: skip
    rows: list[Cells] = []
    sigma = all_together(fit, result.scatter, result.methods)
    f_std, zeta_std = sigma.f_std_hz, sigma.zeta_std
    for i, (f, zeta) in enumerate(zip(fit.model.f_hz, fit.model.zeta, strict=True)):
        rows.append([
            i + 1, float(f), float(f_std[i]), PERCENT * float(zeta), PERCENT * float(zeta_std[i]),
            float(fit.lines_per_bandwidth[i]),
            PERHAPS if result.mirrored[i] else SHADOW if result.shadows[i]
            else _knowledge(result, float(fit.lines_per_bandwidth[i]), float(zeta), float(zeta_std[i])),
            PERCENT * _collinearity(_shape(result, i)),
        ])  # fmt: skip
    notes = [
        f"common poles, fit error {PERCENT * fit.model.error:.2f} % of the responses"
        + (f"; responses by {result.source.estimator}" if result.source.estimator else ""),
        "± is one sigma: the larger of fit and bootstrap, and the scatter over methods",
        f"with less than a line per bandwidth ({WINDOWED_LINES:g} behind a window) damping rests on the "
        "leakage, and ± tells noise only",
        f"a damping is known where its ± is at most {PERCENT * KNOWN:g} % of it",
        *_faster(result, fit),
        *_shadows(result, fit),
    ]
    return Table("Modes", heads, rows, notes)


def _faster(result: Result, fit: PoleFit) -> list[str]:
    """Return of which modes the poles are perhaps the mirror images."""
    return [
        f"{f:.2f} Hz is perhaps the mode of {faster.f_hz:.1f} Hz, sampled at {faster.rate_hz:g} Hz: "
        f"it shows at {faster.seen_hz:.1f} Hz; nothing is fitted to it"
        for f, faster in zip(fit.model.f_hz, result.mirrored, strict=True)
        if faster
    ]


def _shadows(result: Result, fit: PoleFit) -> list[str]:
    """Return which poles are none of a linear arm."""
    return [
        f"{f:.2f} Hz has the shape of {beside:.2f} Hz but other motors drive it, as no linear arm has: "
        "nothing is fitted to it; a smaller motion (--share) tells whether it stays"
        for f, beside in zip(fit.model.f_hz, result.shadows, strict=True)
        if beside
    ]


def _knowledge(result: Result, lines: float, zeta: float, zeta_std: float) -> str:
    """Return how well a damping is known, by the lines per bandwidth and its sigma."""
    if lines < result.needed_lines:
        return "not identifiable"
    return "known" if zeta_std <= KNOWN * zeta else "uncertain"


def _sources(result: Result, fit: PoleFit) -> Table:
    """Return where the uncertainty comes from."""
    heads = [Column("mode", "d")] + [
        Column(f"{what} ± {unit}\n{by}", spec)
        for what, unit, spec in (("frequency", "[Hz]", ".5f"), ("damping", "[%]", ".4f"))
        for by in ("fit", "bootstrap", "methods")
    ]
    by = (fit, result.scatter, result.methods)
    rows: list[Cells] = [
        [
            i + 1,
            *(float(part.f_std_hz[i]) if part else None for part in by),
            *(PERCENT * float(part.zeta_std[i]) if part else None for part in by),
        ]
        for i in range(fit.model.f_hz.size)
    ]
    notes = [
        "fit: from its curvature, for white noise; bootstrap: averages drawn again; methods: poles of the "
        "chart, free residues, more remainders, either end of the band cut"
    ]
    return Table("Where ± comes from", heads, rows, notes)


def _beside(result: Result, fit: PoleFit) -> Table:
    heads = [
        Column("frequency\n[Hz]", ".4f"), Column("half power\n[Hz]", ".4f"),
        Column("half power\ndamping [%]", ".3f"), Column("one reference,\nchart only [Hz]", ".4f"),
        Column("model\n[Hz]", ".4f"), Column("measured over\nmodel [%]", "+.2f"),
    ]  # fmt: skip
    rows: list[Cells] = []
    others = [faster or beside for faster, beside in zip(result.mirrored, result.shadows, strict=True)]
    for f, simple, other in zip(fit.model.f_hz, result.half_power, others, strict=True):
        single = _nearest(result.single_hz, float(f))
        model = None if other else _nearest(result.model_hz, float(f))
        half: Cells = [None, simple] if isinstance(simple, str) else [simple.f_hz, PERCENT * simple.zeta]
        against = PERCENT * (float(f) / model - 1) if model else None
        rows.append([float(f), *half, single, model, against])
    return Table("Simpler methods and the model beside", heads, rows)


def _nearest(values: Sequence[float], f_hz: float, within: float = 0.5) -> float | None:
    """Return the value nearest to ``f_hz`` unless it is further off than that share."""
    near = min(values, key=lambda value: abs(value - f_hz), default=None)
    return near if near is not None and abs(near - f_hz) <= within * f_hz else None


def _shape(result: Result, i: int) -> np.ndarray:
    """Return the shape at the sensors as displacements, largest entry 1, (n_out,)."""
    assert result.found.fit is not None
    model = result.found.fit.model
    shape = np.linalg.svd(model.residues[i])[0][:, 0]
    if not result.is_reciprocal:
        kinds = result.responses.kinds
        powers = [KINDS[kinds.get(name, model.kind)] - KINDS[model.kind] for name in result.responses.outputs]
        shape = shape / model.poles[i] ** np.array(powers)
    return np.asarray(shape / shape[abs(shape).argmax()])


def _sensors(result: Result) -> tuple[list[str], list[str]]:
    """Return names and units of what a shape is told at; sensors in different units share no scale."""
    responses = result.responses
    if result.is_reciprocal:
        return list(responses.inputs), [""] * len(responses.inputs)
    names = list(responses.outputs)
    if not responses.kinds:
        return names, [""] * len(names)
    return names, [MOVES.get(responses.kinds.get(name, ""), name.rpartition(".")[2]) for name in names]


def _collinearity(shape: np.ndarray) -> float:
    """Return the modal phase collinearity: 1 for a shape whose parts move in phase or against it [1].

    Of the second moments of real and imaginary parts about zero, which is where a shape swings about: those
    about the mean would call sensors that move alike out of phase.

    Args:
        shape: Complex, (n_out,).
    """
    parts = np.stack([shape.real, shape.imag])
    low, high = np.linalg.eigvalsh(parts @ parts.T)
    return float(((high - low) / (high + low)) ** 2) if high > 0 else 1.0


def _doubts(result: Result) -> list[str]:
    lines = [
        f"{f:.3f} Hz came back at many orders, but the fit does not hold it" for f in result.found.dropped_hz
    ]
    lines += [
        f"{mode.f_hz:.3f} Hz is left out: its ± of {mode.f_std_hz:.3g} Hz is more than its bandwidth (or a "
        f"line) of {mode.bandwidth_hz:.3g} Hz"
        for mode in result.unsure
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
        why = result.in_vain or (UNEXCITED if _is_of_moves(result) else "")
        lines += ["no mode stands out of the noise in this band", *filter(None, [why])]
    if result.frf.f_hz.size > MANY_LINES:
        lines.append(
            f"{result.frf.f_hz.size} lines are many: narrow modes may be missed, try a --band about them"
        )
    return lines


def _is_of_moves(result: Result) -> bool:
    """Tell whether a record is of an arm that nobody excited."""
    return any(run.is_of_moves for runs in result.source.set_ups for run in runs)
