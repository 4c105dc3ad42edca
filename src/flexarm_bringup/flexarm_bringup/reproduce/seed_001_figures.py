"""The plots of the page of seed 001."""

from __future__ import annotations

import numpy as np

from flexarm_bringup.figures import COLOURS, INK, Figure, drawing, to_figure
from flexarm_bringup.reproduce.seed_001_close import DISTANCES_HZ, LEVELS_DB, Studies
from flexarm_bringup.reproduce.seed_001_machine import FIRST, ROWS, SECOND, magnitude
from flexarm_bringup.reproduce.seed_001_presets import Machines
from flexarm_bringup.reproduce.seed_001_shapes import mode_lines

LINES = np.arange(60.0, 200.25, 0.25)  # Hz
OFF_DEG = 10.0
VIEWS = {FIRST: (-1.0, 1.0, "across, along (−1, 1, 0)"), SECOND: (1.0, 1.0, "along (1, 1, 0)")}


def response_figure(machines: Machines) -> Figure:
    """Return the receptances of tool and platform with the band that half-power reads."""
    with drawing(9.0, 3.8) as plot:
        for axes, (name, machine) in zip(plot.subplots(1, 2, sharey=True), machines.items(), strict=True):
            for point, colour in zip(ROWS, COLOURS, strict=False):
                frf = machine.drive_point(point, machine.force(point), LINES)
                axes.semilogy(LINES, 1e3 * magnitude(frf), color=colour, label=point)
                found = machine.reading(point)
                level = 1e3 * found.height / np.sqrt(2)
                axes.fill_between(
                    [found.low_hz, found.high_hz], level, 1e3 * found.height, color=colour, alpha=0.3
                )
            turned = machine.drive_point("tool", machine.force("tool", OFF_DEG), LINES)
            axes.semilogy(
                LINES, 1e3 * magnitude(turned), ":", color=COLOURS[0], label=f"tool, force {OFF_DEG:g}° off"
            )
            axes.set(title=f"{name} preset", xlabel="frequency [Hz]", xlim=(LINES[0], LINES[-1]))
        plot.axes[0].set_ylabel("|x, y, z| per force [mm/N]")
        plot.legend(*plot.axes[0].get_legend_handles_labels(), loc="outside upper right", ncols=3)
        return to_figure(
            plot,
            "Receptance at tool and platform, force along mode 2 at the same point. Shaded: the half-power "
            "band on a 1 Hz grid. A force that is 10° off shows the first mode as well.",
        )


def shape_figure(machines: Machines) -> Figure:
    """Return the first two modes of the sim preset on the mechanism, each seen where it moves."""
    machine = machines["sim"]
    with drawing(9.0, 4.4) as plot:
        for axes, (mode, (x, y, name)) in zip(plot.subplots(1, 2, sharey=True), VIEWS.items(), strict=True):
            across = np.array([x, y, 0.0]) / np.sqrt(2)
            lines = mode_lines(machine, mode)
            for style, colour, drawn in (("--", INK, lines.still), ("-", COLOURS[mode], lines.moved)):
                for line in drawn:
                    axes.plot(1e3 * line @ across, 1e3 * line[:, 2], style, color=colour, linewidth=1.2)
            axes.plot(*(1e3 * lines.moved[0][-1] @ np.column_stack([across, [0, 0, 1]])), "o", color=colour)
            axes.set(
                aspect="equal", xlabel=f"{name} [mm]", title=f"mode {mode + 1}, {machine.f_hz[mode]:.1f} Hz"
            )
        plot.axes[0].set_ylabel("z [mm]")
        return to_figure(
            plot,
            "Modes 1 and 2 on the mechanism, drives held, each seen from the side it moves along "
            "(dashed: at rest; dot: tool). Mode 1 swings on the constraint's soft axis.",
        )


def distance_figure(studies: Studies) -> Figure:
    """Return the error of the damping over the distance of two modes."""
    with drawing(9.0, 3.8) as plot:
        axes = plot.subplots()
        quiet = [studies[d][LEVELS_DB[0]] for d in DISTANCES_HZ]
        for label, errors in (
            ("space", [item.space for item in quiet]),
            ("best", [item.best for item in quiet]),
        ):
            text = "half-power, magnitude over x, y, z" if label == "space" else "half-power, best curve"
            axes.loglog(DISTANCES_HZ, np.max(errors, axis=1), "s--", label=f"{text}, 40 dB")
        for level in LEVELS_DB:
            errors = [studies[d][level].zeta for d in DISTANCES_HZ]
            axes.loglog(DISTANCES_HZ, np.max(errors, axis=1), "o-", label=f"modal fit, {level:g} dB")
        axes.axvline(6.0, color=COLOURS[5], linewidth=0.8, linestyle=":")
        axes.set_xticks(DISTANCES_HZ, [f"{d:g}" for d in DISTANCES_HZ])
        axes.set_xticks([], minor=True)
        axes.set(xlabel="distance of the modes [Hz]", ylabel="rms error of ζ, worse mode [%]")
        plot.legend(loc="outside right upper")
        return to_figure(
            plot,
            "How far damping is off when two modes stand close; dotted: their half-power bandwidth, 6 Hz. "
            "The best curve is chosen with hindsight.",
        )
