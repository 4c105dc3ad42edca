"""The figures of ``flexarm margins``: poles of the closed loop, and margins per mode."""

from __future__ import annotations

from typing import Any

import numpy as np

from flexarm_bringup.margins.study import Study, worst_of
from flexarm_bringup.page.figures import COLOURS, Figure, drawing, to_figure
from flexarm_controller.margins.case import Case
from flexarm_controller.margins.verdict import MS, PERCENT, spoken, wanted_delay, wanted_gain_db
from flexarm_controller.settings import MarginConfig

MODES_NAMED = len(COLOURS)  # slowest modes with a colour of their own
GREY = "#888888"
HIGHEST_DB = 40.0


def draw(study: Study, config: MarginConfig) -> list[Figure]:
    """Return the poles and the margins."""
    return [_draw_poles(study), _draw_margins(study, config)]


def _draw_poles(study: Study) -> Figure:
    with drawing(9.0, 4.9) as plot:
        axes = plot.subplots()
        circle = np.exp(1j * np.linspace(0.0, np.pi, 200))
        axes.plot(circle.real, circle.imag, color=GREY, linewidth=0.8)
        for k in range(MODES_NAMED):
            _scatter(axes, study.cases, f"mode_{k + 1}", COLOURS[k])
        others = {name for case in study.cases for name in case.pole_modes}
        rest = others - {f"mode_{k + 1}" for k in range(MODES_NAMED)}
        for name in sorted(rest):
            _scatter(axes, study.cases, name, GREY, is_named=False)
        axes.set(xlabel="real part", ylabel="imaginary part", aspect="equal")
        axes.legend(loc="upper left", fontsize=8)
        caption = (
            "Eigenvalues of the closed loop in a period, upper half, at all poses and with all frequency "
            "errors, by the mode that takes part in them most (grey: axes, filter, faster modes). "
            "Outside the circle they grow."
        )
        return to_figure(plot, caption)


def _scatter(axes: Any, cases: list[Case], name: str, colour: str, is_named: bool = True) -> None:
    poles = np.concatenate([case.poles[np.array(case.pole_modes) == name] for case in cases])
    poles = poles[poles.imag >= 0.0]
    if poles.size:
        label = spoken(name) if is_named else None
        axes.scatter(poles.real, poles.imag, s=12, color=colour, label=label, alpha=0.8, linewidths=0)


def _draw_margins(study: Study, config: MarginConfig) -> Figure:
    names = list(dict.fromkeys(margin.name for case in study.cases for margin in case.margins))
    with drawing(9.0, 4.6) as plot:
        upper, lower = plot.subplots(2, 1, sharex=True)
        for i, name in enumerate(names):
            worst = worst_of(study.cases, name)
            assert worst is not None  # the name is of a case that has it
            gain, delay = worst
            db = min(gain.margin(name).gain.decibels, HIGHEST_DB)
            _bar(upper, i, db, wanted_gain_db(name, gain, config), gain)
            wanted = wanted_delay(delay, config, study.dt)
            _bar(lower, i, delay.margin(name).delay * MS, wanted * MS, delay)
        upper.set_ylabel("gain margin [dB]")
        lower.set_ylabel("delay margin [ms]")
        lower.set_xticks(range(len(names)), [spoken(name) for name in names], rotation=60, fontsize=7)
        caption = (
            "Smallest margins of every path over poses and frequency errors (the error above each bar); "
            f"the line is what is wanted there. Gains are cut at {HIGHEST_DB:.0f} dB."
        )
        return to_figure(plot, caption)


def _bar(axes: Any, i: int, value: float, wanted: float, case: Case) -> None:
    axes.bar(i, value, color=COLOURS[1] if value < wanted else COLOURS[0])
    axes.plot([i - 0.4, i + 0.4], [wanted, wanted], color=GREY)
    axes.annotate(f"{case.frequency_error * PERCENT:+.0f} %", (i, value), ha="center", fontsize=6)
