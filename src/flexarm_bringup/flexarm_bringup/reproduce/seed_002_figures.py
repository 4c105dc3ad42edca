"""The three plots of the page of seed 002."""

from __future__ import annotations

from flexarm_bringup.figures import COLOURS, Figure, drawing, to_figure
from flexarm_bringup.reproduce.seed_002_data import EXPERIMENT, ModalData, Published, Records, record
from flexarm_bringup.reproduce.seed_002_shaping import FREQUENCY_ERRORS, Results
from flexarm_bringup.residual import decibels

SHOWN = 3.0  # s of every record


def response_figure(published: Published, modes: ModalData) -> Figure:
    """Return the relative tip acceleration of the loudest and the quietest case at each angle."""
    with drawing(9.0, 3.4) as plot:
        axes = plot.subplots(1, 3, sharex=True)
        for axis, angle, degrees in zip(axes, "123", (10, 30, 60), strict=True):
            for case, colour in ((f"C{angle}A", COLOURS[1]), (f"C{angle}B", COLOURS[0])):
                shown = record(published.motions[case], modes.first, EXPERIMENT.damping, SHOWN)
                axis.plot(shown.t, shown.acceleration, color=colour, label=f"case {case[-1]}", linewidth=1.2)
            axis.axvline(1.0, color=COLOURS[5], linewidth=0.8, linestyle=":")
            axis.set_title(f"{degrees}°")
            axis.set_xlabel("t [s]")
        axes[0].set_ylabel("relative tip acceleration [m/s²]")
        axes[0].legend()
        return to_figure(
            plot,
            "The same second, stopped in half a period (case A) or in a whole one (case B). "
            "Dotted: end of the motion. Damping law fitted on the experiment.",
        )


def rms_figure(published: Published, records: Records) -> Figure:
    """Return calibrated against printed RMS on logarithmic axes."""
    with drawing(9.0, 4.2) as plot:
        for axis, (key, name) in zip(
            plot.subplots(1, 2), (("sim", "simulation"), ("exp", "experiment")), strict=True
        ):
            printed = published.rms[key]
            ends = [0.12, 9.0]
            axis.fill_between(
                ends, [0.9 * x for x in ends], [1.1 * x for x in ends], color=COLOURS[0], alpha=0.15
            )
            for letter, colour in zip("ABCDE", COLOURS, strict=False):
                cases = [f"C{angle}{letter}" for angle in "123"]
                ours = [records[key][case].rms for case in cases]
                axis.plot([printed[case] for case in cases], ours, "o", color=colour, label=letter)
            axis.set(xscale="log", yscale="log", xlim=ends, ylim=ends, xlabel=f"printed {name} RMS [m/s²]")
        plot.axes[0].set_ylabel("ours, calibrated [m/s²]")
        plot.axes[0].legend(title="case")
        return to_figure(
            plot, "All fifteen rows of table 2; the band is ±10 %. Three numbers are fitted on these values."
        )


def shaping_figure(results: Results) -> Figure:
    """Return the residual over the frequency error of every motion."""
    base = results[next(iter(results))][0.0].residual
    with drawing(9.0, 3.8) as plot:
        axis = plot.subplots()
        for name, at in results.items():
            axis.plot(
                [100.0 * e for e in FREQUENCY_ERRORS],
                [decibels(at[e].residual, base) for e in FREQUENCY_ERRORS],
                "o-",
                label=name,
            )
        axis.set(
            xlabel="frequency of the arm against the one designed for [%]",
            ylabel="residual vibration [dB]",
            ylim=(-90, 5),
        )
        axis.legend(ncols=3, loc="lower center", fontsize=8.5)
        return to_figure(
            plot,
            "What each motion leaves when the arm is not quite as modelled; "
            "10° in 1 s, ideal servo, 0 dB is case A at the exact frequency.",
        )
