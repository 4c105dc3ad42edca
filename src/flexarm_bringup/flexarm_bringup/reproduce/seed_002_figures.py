"""The three plots of the page of seed 002."""

from __future__ import annotations

from flexarm_bringup.page.figures import COLOURS, Figure, drawing, to_figure
from flexarm_bringup.reproduce.seed_002_data import EXPERIMENT, ModalData, Published, Records, record
from flexarm_bringup.reproduce.seed_002_shaping import measure, motions
from flexarm_bringup.residual import decibels

SHOWN = 3.0  # s of every record
TICKS = (0.2, 0.5, 1.0, 2.0, 5.0)  # m/s^2
SWEEP = [0.01 * percent for percent in range(-12, 13, 2)]  # of the frequency


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
        plot.legend(*axes[0].get_legend_handles_labels(), loc="outside upper right", ncols=2)
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
            for side in (axis.xaxis, axis.yaxis):
                side.set_ticks(TICKS, [f"{tick:g}" for tick in TICKS])
                side.set_ticks([], minor=True)
        plot.axes[0].set_ylabel("ours, calibrated [m/s²]")
        plot.axes[0].legend(title="case", loc="lower right")
        return to_figure(
            plot, "All fifteen rows of table 2; the band is ±10 %. Three numbers are fitted on these values."
        )


def shaping_figure(modes: ModalData) -> Figure:
    """Return the residual over the frequency error of every motion."""
    profiles = motions(modes)
    levels = {
        name: [measure(profile, modes, off).residual for off in SWEEP] for name, profile in profiles.items()
    }
    base = levels[next(iter(levels))][SWEEP.index(0.0)]
    with drawing(9.0, 4.0) as plot:
        axis = plot.subplots()
        for name, residuals in levels.items():
            axis.plot(
                [100.0 * off for off in SWEEP], [decibels(value, base) for value in residuals], label=name
            )
        axis.set(
            xlabel="frequency of the arm against the one designed for [%]", ylabel="residual vibration [dB]"
        )
        axis.set(xlim=(-12, 12), ylim=(-70, 4))
        plot.legend(loc="outside upper center", ncols=3)
        return to_figure(
            plot,
            "What each motion leaves when the arm is not quite as modelled; "
            "10° in 1 s, ideal servo, 0 dB is case A at the exact frequency.",
        )
