"""The plots of the page of seed 001."""

from __future__ import annotations

import numpy as np

from flexarm_bringup.model_view.mechanism_figure import Shape, draw_shape, mode_shape
from flexarm_bringup.model_view.mechanism_lines import Line, MechanismLines
from flexarm_bringup.page.figures import COLOURS, Figure, drawing, to_figure
from flexarm_bringup.reproduce.seed_001_close import DISTANCES_HZ, LEVELS_DB, Studies
from flexarm_bringup.reproduce.seed_001_machine import FIRST, ROWS, SECOND, magnitude
from flexarm_bringup.reproduce.seed_001_presets import Machines

LINES = np.arange(60.0, 200.25, 0.25)  # Hz
OFF_DEG = 10.0
VIEWS = {FIRST: ((1, 2), "(−1, 1, 0)"), SECOND: ((0, 2), "(1, 1, 0)")}  # in axes turned by 45 degrees


def response_figure(machines: Machines) -> Figure:
    """Return the receptances of tool and platform with the band that half-power reads."""
    with drawing(9.0, 3.8) as plot:
        for axes, (name, machine) in zip(plot.subplots(1, 2, sharey=True), machines.items(), strict=True):
            for point, colour in zip(ROWS, COLOURS, strict=False):
                frf = machine.drive_point(point, machine.force(point), LINES)
                axes.semilogy(LINES, 1e3 * magnitude(frf), color=colour, label=point)
                if found := machine.reading(point):
                    top = 1e3 * found.height
                    band = [found.low_hz, found.high_hz]
                    axes.fill_between(band, top / np.sqrt(2), top, color=colour, alpha=0.3)
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
    model, mechanism = machine.model, MechanismLines(machine.tree)
    with drawing(9.0, 4.4) as plot:
        for axes, (mode, (view, along)) in zip(plot.subplots(1, 2, sharey=True), VIEWS.items(), strict=True):
            shape = mode_shape(mechanism, model.q0, model.Phi[:, model.n_theta + mode])
            draw_shape(axes, _turned(shape), view, COLOURS[mode])
            axes.set(xlabel=f"along {along} [m]", title=f"mode {mode + 1}, {machine.f_hz[mode]:.1f} Hz")
        return to_figure(
            plot,
            "Modes 1 and 2 on the mechanism, drives held, each seen from the side it moves along. "
            "Mode 1 turns the platform on the soft axis of the constraint; mode 2 bends the legs.",
        )


def _turned(shape: Shape) -> Shape:
    """Return the drawing in axes along the constraint's, 45 degrees about z."""
    c = np.sqrt(0.5)
    R = np.array([[c, c, 0.0], [-c, c, 0.0], [0.0, 0.0, 1.0]])
    rest, there, back = (
        [Line(line.body, line.points @ R.T) for line in lines]
        for lines in (shape.rest, shape.there, shape.back)
    )
    return Shape(rest, there, back, shape.scale, shape.joints @ R.T)


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
