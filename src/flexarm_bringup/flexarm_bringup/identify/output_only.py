"""``flexarm identify FILE --output-only``: modes of a record without inputs, and their page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import scipy
from numpy.typing import NDArray

from flexarm_bringup.identify.chart_figure import chart_figure
from flexarm_bringup.identify.measurement import Records, SourceError, known_outputs
from flexarm_bringup.identify.shapes_figure import shapes_figure
from flexarm_bringup.page.figures import Figure, drawing, to_figure
from flexarm_bringup.page.report import Cells, Column, Page, Table
from flexarm_model.identification.ssi import OutputModes, output_modes, output_poles

Array = NDArray[np.float64]
PERCENT = 100.0
LOWEST = 1 / 200  # of the rate: lower end of the band when nobody says
USABLE = 1 / 2.56  # of the rate
PARTS, CYCLES = 4, 42.0  # parts of the record at most; cycles of the slowest mode that one needs
FAR = 6.0  # a mode over the begin of the band: the covariances reach over many of its periods
WHITE = "at least what a white excitation leaves of a record that long"
RINGS_DOWN = "the record rings down: its parts are turns of it, not one after the other"
STILL = 1e-12  # standard deviation over the largest value of a channel that does not move


def output_only_page(
    files: Sequence[Path], records: Sequence[Records], band_hz: tuple[float, float] | None,
    ignore: Sequence[str] = (), measured: Sequence[Table] = (),
) -> Page:  # fmt: skip
    """Identify and return the page.

    Args:
        files: Where it comes from.
        records: One record.
        band_hz: Of the modes [Hz]; None takes what was excited, or what the rate allows.
        ignore: Outputs to leave out.
        measured: How it was measured.

    Raises:
        SourceError: There are several records, this one is too short or has samples that are not finite, or
            an output to ignore is not in it.
    """
    record = records[0]
    if len(records) > 1:
        raise SourceError(f"--output-only takes one record, not {len(records)}")
    left_out = known_outputs(tuple(record.outputs), ignore, ignore if measured else ())
    wanted = {name: values for name, values in record.outputs.items() if name not in left_out}
    names = _moving(", ".join(map(str, files)), wanted)
    y = np.column_stack([record.outputs[name] for name in names])
    band = band_hz or record.band_hz or (LOWEST * record.rate_hz, USABLE * record.rate_hz)
    try:
        modes = output_modes(y, record.rate_hz, band, _parts(len(y) / record.rate_hz, band[0]))
        chart = output_poles(y, record.rate_hz, band)
    except ValueError as error:
        raise SourceError(str(error)) from error
    lead = (
        f"{', '.join(path.name for path in files)}: {len(names)} output(s), {len(y) / record.rate_hz:.4g} s "
        f"at {record.rate_hz:g} Hz, from {band[0]:.4g} to {band[1]:.4g} Hz; what excited them is not known."
    )
    items: list[Table | Figure] = [
        _modes(modes), _spectra(y, record.rate_hz, band, modes), chart_figure(chart, modes.f_hz),
        *([shapes_figure(modes.f_hz, modes.zeta, modes.shapes, names)] if modes.f_hz.size else []),
        *measured,
    ]  # fmt: skip
    return Page(
        "Modes from outputs alone",
        lead,
        items,
        remarks={"What this cannot tell": [*record.remarks, *_limits(modes, band)]},
    )


def _moving(source: str, outputs: Mapping[str, Array]) -> list[str]:
    """Return the names of the outputs of a source that move.

    Raises:
        SourceError: None does, or one has samples that are not finite: subspaces need every one.
    """
    missing = {name: int(np.sum(~np.isfinite(values))) for name, values in outputs.items()}
    told = [f"{count} of {outputs[name].size} samples of {name}" for name, count in missing.items() if count]
    if told:
        raise SourceError(
            f"{source}: not finite: {', '.join(told)}; repair them, or leave it out with --ignore-channel"
        )
    names = [name for name, values in outputs.items() if np.std(values) > STILL * abs(values).max()]
    if not names:
        raise SourceError(f"{source}: no output moves")
    return names


def _parts(seconds: float, low_hz: float) -> int:
    """Return into how many parts a record can be cut, each long enough for itself."""
    return int(np.clip(seconds * low_hz / CYCLES, 2, PARTS))


def _modes(modes: OutputModes) -> Table:
    heads = [
        Column("mode", "d"), Column("frequency\n[Hz]", ".4f"), Column("±\n[Hz]", ".4f"),
        Column("damping\n[%]", ".3f"), Column("±\n[%]", ".3f"), Column("parts"),
    ]  # fmt: skip
    rows: list[Cells] = [
        [i + 1, float(f), float(f_std), PERCENT * float(zeta), PERCENT * float(zeta_std),
         f"{parts} of {modes.of_parts}"]
        for i, (f, f_std, zeta, zeta_std, parts) in enumerate(
            zip(modes.f_hz, modes.f_std_hz, modes.zeta, modes.zeta_std, modes.parts, strict=True)
        )
    ]  # fmt: skip
    return Table("Modes", heads, rows, [
        "covariance-driven subspaces; a mode shows in the whole record and in most of its parts",
        "± is that of the mean over the parts that show it, widened as they are few (Student), and how far "
        "that mean is from the whole record; "
        + (RINGS_DOWN if modes.rings_down else WHITE),
    ])  # fmt: skip


def _limits(modes: OutputModes, band: tuple[float, float]) -> list[str]:
    below = [
        f"{f:.4g} Hz lies far above the {band[0]:.3g} Hz at which the band begins: one mode may show as "
        f"several then, of less damping; look at it with --band {f / 2:.3g} {band[1]:.4g}"
        for f in modes.f_hz if f > FAR * band[0]
    ]  # fmt: skip
    dropped = [
        f"{mode.f_hz:.4g} Hz ({PERCENT * mode.zeta:.3g} % damping) is left out: the whole record shows it, "
        f"but only {mode.parts} of its {mode.of_parts} parts"
        for mode in modes.dropped
    ]
    lines = [
        *dropped,
        *below,
        "a hum at a frequency of its own looks like a mode of hardly any damping",
        "under feedback these are the poles of arm and controller together",
        "without the input there is no modal mass: shapes have no scale",
    ]
    return lines if modes.f_hz.size else ["no mode shows in most parts of the record", *lines]


def _spectra(y: Array, rate_hz: float, band: tuple[float, float], modes: OutputModes) -> Figure:
    f_hz, power = scipy.signal.welch(y, rate_hz, nperseg=min(len(y), int(8 * rate_hz / band[0])), axis=0)
    inside = (f_hz >= band[0]) & (f_hz <= band[1])
    with drawing(9.0, 3.4) as plot:
        axes = plot.subplots()
        axes.semilogy(f_hz[inside], power[inside] / power[inside].max(axis=0), linewidth=0.9)
        for f in modes.f_hz:
            axes.axvline(f, color="#8a7d2f", linewidth=0.8)
        axes.set(xlabel="frequency [Hz]", ylabel="power density,\nlargest 1")
        return to_figure(plot, "Power of every output, each by its largest; lines: modes found.")
