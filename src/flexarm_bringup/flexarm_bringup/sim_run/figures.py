"""The plot of ``flexarm sim``: how far the tip is from where it settles, joint PD beside MPC."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.page.figures import Figure, drawing, to_figure
from flexarm_bringup.sim_run.conditions import NOMINAL
from flexarm_bringup.sim_run.report import by_condition
from flexarm_bringup.sim_run.study import SimResult
from flexarm_bringup.tasks.task import Task
from flexarm_bringup.tip_vibration import LAST_PART

Array = NDArray[np.float64]
BEFORE = 0.25  # s of the move's end that are shown
SHOWN = 1.0  # share of the window that is shown
NAMES = {"pd": "joint PD", "mpc": "MPC"}
HEADROOM = 1.3  # of the axis above the largest deviation after the move
FEWEST_MM = 0.05  # smallest half-height of the axis [mm]


def draw(task: Task, results: Sequence[SimResult]) -> list[Figure]:
    """Return one figure per preset: the nominal arm after every move."""
    figures = []
    for (preset, condition), pair in by_condition(results).items():
        if condition == NOMINAL:
            figures.append(_deviation(task, preset, pair))
    return figures


def _deviation(task: Task, preset: str, pair: dict[str, SimResult]) -> Figure:
    legs = next(iter(pair.values())).legs
    with drawing(9.0, 2.0 + 1.7 * len(legs)) as plot:
        panels = plot.subplots(len(legs), 1, squeeze=False)[:, 0]
        for i, axes in enumerate(panels):
            _panel(axes, task, pair, i)
        panels[-1].set_xlabel("time since the end of the motion [s]")
        plot.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=2, fontsize=8)
        caption = (
            f"Tip of {task.manipulator} {f'({preset})' if preset else ''}: off where it settles, "
            f"along the direction in which it vibrates most (band: {1e3 * task.watch.tolerance:g} mm)."
        )
        return to_figure(plot, caption)


def _panel(axes: Any, task: Task, pair: dict[str, SimResult], i: int) -> None:
    largest = FEWEST_MM
    direction: Array | None = None
    for law, result in pair.items():
        leg, trace = result.legs[i].leg, result.trace
        shown = (trace.t >= leg.end - BEFORE) & (trace.t <= leg.end + SHOWN * task.watch.end)
        after = trace.t[shown] >= leg.end
        off = trace.tip[shown] - trace.tip[shown][-max(int(LAST_PART * after.sum()), 1) :].mean(axis=0)
        if direction is None:  # of the first law, so that both are seen from the same side
            direction = np.linalg.svd(off[after])[2][0]
        distance = 1e3 * off @ direction
        largest = max(largest, float(abs(distance[after]).max()))
        axes.plot(trace.t[shown] - leg.end, distance, label=NAMES.get(law, law))
    band = 1e3 * task.watch.tolerance
    axes.axhspan(-band, band, color="#888888", alpha=0.2, linewidth=0)
    axes.axvline(0.0, color="#888888", linewidth=0.8, linestyle=":")
    axes.set(ylim=(-HEADROOM * largest, HEADROOM * largest), ylabel="tip off rest [mm]")
    axes.set_title(next(iter(pair.values())).legs[i].leg.name)
