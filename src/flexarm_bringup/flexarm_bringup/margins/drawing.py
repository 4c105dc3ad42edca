"""The figures of ``flexarm margins``: poles of the closed loop, and margins per mode."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.margins.study import Study, worst_of
from flexarm_bringup.page.figures import COLOURS, Figure, drawing, to_figure
from flexarm_controller.margins.case import SURE, Case
from flexarm_controller.margins.delay_margin import MOST
from flexarm_controller.margins.verdict import MS, PERCENT, spoken, wanted_delay, wanted_gain_db
from flexarm_controller.settings import MarginConfig

MODES_NAMED = len(COLOURS)  # slowest modes with a colour of their own
GREY, RED = "#888888", "#c0392b"
OTHERS, GROWS = "axes, filter,\nfaster modes", "grows"
HIGHEST_DB = 40.0  # bars are cut there
HEADROOM = 1.25  # for what stands above the bars


def draw(study: Study, config: MarginConfig) -> list[Figure]:
    """Return the poles and the margins."""
    return [_draw_poles(study), _draw_margins(study, config)]


def _draw_poles(study: Study) -> Figure:
    with drawing(9.0, 4.9) as plot:
        axes = plot.subplots()
        circle = np.exp(1j * np.linspace(0.0, np.pi, 200))
        axes.plot(circle.real, circle.imag, color=GREY, linewidth=0.8)
        poles = np.concatenate([np.zeros(0, complex), *(case.poles for case in study.cases)])
        names = np.array([name for case in study.cases for name in case.pole_modes], dtype=str)
        named = [f"mode_{k + 1}" for k in range(MODES_NAMED)]
        grows = abs(poles) >= 1.0 - SURE
        groups = [(spoken(name), names == name, COLOURS[k]) for k, name in enumerate(named)]
        groups.append((OTHERS, ~np.isin(names, named), GREY))
        for label, which, colour in groups:
            _scatter(axes, poles[which & ~grows], label, color=colour, s=12, alpha=0.8, linewidths=0)
        _scatter(axes, poles[grows], GROWS, color=RED, s=40, marker="x", linewidths=1.5)
        axes.set(xlabel="real part", ylabel="imaginary part", aspect="equal")
        plot.legend(*axes.get_legend_handles_labels(), loc="outside right upper", fontsize=8)
        caption = (
            "Eigenvalues of the closed loop in a period, upper half, at all poses and with all frequency "
            "errors, by the mode that takes part in them most. What lies on the circle or outside grows: "
            f"{'the crosses' if grows.any() else 'nothing here'}."
        )
        return to_figure(plot, caption)


def _scatter(axes: Any, poles: NDArray[np.complex128], label: str, **style: Any) -> None:
    poles = poles[poles.imag >= 0.0]
    if poles.size:
        axes.scatter(poles.real, poles.imag, label=label, **style)


def _draw_margins(study: Study, config: MarginConfig) -> Figure:
    names = list(dict.fromkeys(margin.name for case in study.cases for margin in case.margins))
    with drawing(9.0, 5.4) as plot:
        upper, lower = plot.subplots(2, 1, sharex=True)
        for i, name in enumerate(names):
            worst = worst_of(study.cases, name)
            assert worst is not None  # the name is of a case that has it
            gain, delay = worst
            db, here = gain.margin(name).gain.decibels, delay.margin(name)
            wanted_db, wanted = wanted_gain_db(name, gain, config), wanted_delay(delay, config, study.dt)
            _bar(upper, i, min(db, HIGHEST_DB), wanted_db, _above(gain, db > HIGHEST_DB))
            _bar(lower, i, here.delay * MS, wanted * MS, _above(delay, here.is_delay_open))
        upper.set(ylabel="gain margin [dB]", ylim=(0.0, HEADROOM * HIGHEST_DB))
        lower.set_ylabel("delay margin [ms]")
        lower.set_ylim(0.0, HEADROOM * max(lower.get_ylim()[1], MOST * study.dt * MS))
        lower.set_xticks(range(len(names)), [spoken(name) for name in names], rotation=90, fontsize=7)
        caption = (
            "Smallest margins of every path over poses and frequency errors (that error above each bar); the "
            f"line is what is wanted there. Under an arrow a bar goes on, beyond {HIGHEST_DB:.0f} dB or the "
            f"{MOST * study.dt * MS:.3g} ms up to which delays were looked at."
        )
        return to_figure(plot, caption)


def _bar(axes: Any, i: int, value: float, wanted: float, text: str) -> None:
    axes.bar(i, value, color=COLOURS[1] if value < wanted else COLOURS[0])
    axes.plot([i - 0.4, i + 0.4], [wanted, wanted], color=GREY)
    place = {"textcoords": "offset points", "ha": "center", "va": "bottom"}
    axes.annotate(text, (i, value), (0, 3), rotation=90, fontsize=6, **place)


def _above(case: Case, is_cut: bool) -> str:
    """Return what stands above a bar: where it was found, or that it goes on."""
    return "\u2192" if is_cut else f"{case.frequency_error * PERCENT:+.0f} %"  # turned: it points up
