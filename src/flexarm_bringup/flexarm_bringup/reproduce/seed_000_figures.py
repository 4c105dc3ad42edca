"""The plots of the page of seed 000."""

from __future__ import annotations

import numpy as np

from flexarm_bringup.model_view.mechanism_figure import mode_shape, modes_figure
from flexarm_bringup.model_view.mechanism_lines import MechanismLines
from flexarm_bringup.page.figures import COLOURS, INK, Figure, drawing, to_figure
from flexarm_bringup.reproduce.seed_000_data import MODES, Published, Served, off_percent
from flexarm_bringup.reproduce.seed_000_modal_test import LINES_HZ, MIDDLES, OUTPUTS, ModalTest, curves

SHOWN_HZ = 30.0  # of the CMIF
FLOOR_DB = 70.0  # of a response below the highest


def shapes_figure(served: Served) -> Figure:
    """Return the nine modes at pose A on the mechanism."""
    model, mechanism = served.models["A"], MechanismLines(served.tree)
    shapes = [mode_shape(mechanism, model.q0, model.Phi[:, model.n_theta + i]) for i in range(MODES)]
    titles = [f"mode {i + 1}: {value:.2f} Hz" for i, value in enumerate(served.f_hz("A"))]
    caption = (
        "Modes of the served model at pose A, motors locked. 1–3: the platform moves on the first strips; "
        "4–6: second strips between their hinges; 7–9: first strips between motor and elbow."
    )
    return modes_figure(shapes, titles, caption)


def error_figure(published: Published, served: Served) -> Figure:
    """Return the errors of every mode at pose B beside those of the null predictor."""
    fe = published.fe
    with drawing(9.0, 3.0) as plot:
        axis = plot.subplots()
        modes = np.arange(1, MODES + 1)
        for offset, (label, values) in zip(
            (-0.18, 0.18),
            (("ours", served.f_hz("B")), ("null: FE of A", fe["A"])),
            strict=True,
        ):
            axis.bar(modes + offset, off_percent(values, fe["B"]), width=0.34, label=label)
        axis.axhline(0.0, color=INK, linewidth=0.8)
        axis.set(xlabel="mode", ylabel="error to the paper's FE [%]", xticks=modes)
        axis.legend()
        return to_figure(
            plot, "Pose B: our prediction and the predictor that says nothing changes between the poses."
        )


def cmif_figure(test: ModalTest, published: Published) -> Figure:
    """Return all curves of the CMIF at both poses, with what is picked and what the paper measured."""
    with drawing(9.0, 4.2) as plot:
        for axis, pose in zip(plot.subplots(1, 2, sharey=True), "AB", strict=True):
            found = curves(test.responses[27, pose])
            inside = found.f_hz <= SHOWN_HZ
            for number in range(found.values.shape[1]):
                axis.semilogy(found.f_hz[inside], found.values[inside, number], linewidth=1.2)
            for item in test.peaks[1, pose]:
                at = item.peak.line
                axis.plot(
                    found.f_hz[at],
                    found.values[at, item.curve],
                    "o",
                    color=INK,
                    fillstyle="none",
                    markersize=6,
                )
            for value in published.ema[pose]:
                axis.axvline(value, color=COLOURS[5], linewidth=0.7, linestyle=":")
            axis.set(title=f"pose {pose}", xlabel="f [Hz]")
        plot.axes[0].set_ylabel("singular values [m/s²/N]")
        return to_figure(
            plot,
            f"CMIF of the modal test on the model, ζ = {test.ratio:g} (assumed), curves traced through "
            "crossings; circles: picked; dotted: frequencies that the paper measured. Not a copy of its "
            "Fig. 4.",
        )


def response_figure(test: ModalTest) -> Figure:
    """Return the FRF matrix in dB: middles of the first strips to ends of the second ones."""
    highest = max(
        float(abs(test.response(27, point, output)).max()) for point in MIDDLES for output in OUTPUTS
    )
    top = 20 * np.log10(highest)
    with drawing(9.0, 6.4) as plot:
        axes = plot.subplots(len(OUTPUTS), len(MIDDLES), sharex=True, sharey=True)
        for row, output in zip(axes, OUTPUTS, strict=True):
            for axis, point in zip(row, MIDDLES, strict=True):
                for modes, width in ((27, 1.3), (MODES, 0.9)):
                    level = 20 * np.log10(abs(test.response(modes, point, output)))
                    axis.semilogx(LINES_HZ, level, linewidth=width, label=f"{modes} modes")
                axis.set(xlim=(1.0, 250.0), ylim=(top - FLOOR_DB, top + 5.0))
                axis.set_xticks([1, 10, 100], ["1", "10", "100"])
        for axis, point in zip(axes[0], MIDDLES, strict=True):
            axis.set_title(f"force at {point}")
        for axis, output in zip(axes[:, 0], OUTPUTS, strict=True):
            axis.set_ylabel(f"{output}\n[dB re 1 m/s²/N]")
        for axis in axes[-1]:
            axis.set_xlabel("f [Hz]")
        plot.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper right", ncols=2)
        return to_figure(
            plot,
            f"Responses at pose A, motors locked, ζ = {test.ratio:g} (assumed): nine served modes follow to "
            "30 Hz and 27 to 250 Hz. Leg, points and damping are assumed; not a copy of Fig. 5.",
        )
