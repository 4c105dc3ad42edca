"""Running frequencies over time, with three sigma, against what is described."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flexarm_bringup.drift_run.simulation import Watched

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Plot

SIGMAS = 3.0
PERCENT = 100.0
WIDEST = 30.0  # per cent; what is less certain is not drawn


def draw_watched(plot: Plot, watched: Watched, told_at: float) -> None:
    """Draw the change of every watched mode's frequency.

    Args:
        plot: An empty figure.
        watched: What the watch said.
        told_at: Relative change that is told [1].
    """
    axes = plot.subplots()
    rows = [(t, modes) for t, modes in zip(watched.t, watched.modes, strict=True) if modes]
    t = np.array([time for time, _ in rows])
    for k in range(len(rows[0][1]) if rows else 0):
        change, sigma = (
            PERCENT * np.array([getattr(modes[k], name) for _, modes in rows])
            for name in ("change", "change_sigma")
        )
        known = SIGMAS * sigma < WIDEST
        (line,) = axes.plot(t, np.where(known, change, np.nan), label=rows[0][1][k].name.replace("_", " "))
        low, high = (np.where(known, change + side * SIGMAS * sigma, np.nan) for side in (-1, 1))
        axes.fill_between(t, low, high, color=line.get_color(), alpha=0.2, linewidth=0)
    for side in (-1, 1):
        axes.axhline(side * PERCENT * told_at, color="#c0392b", linewidth=1.0, linestyle="--")
    for when, _ in watched.alarms:
        axes.axvline(when, color="#c0392b", linewidth=1.0)
    axes.set(xlabel="time [s]", ylabel="frequency over described, minus one [%]")
    if rows:
        axes.legend(fontsize=8, ncols=4)
