"""The plot of the path test of seed 003: how far outside the square the flange is along the lap."""

from __future__ import annotations

import numpy as np

from flexarm_bringup.page.figures import COLOURS, Figure, drawing, to_figure
from flexarm_bringup.reproduce.seed_003_lap import drive_lap, lap, outside
from flexarm_bringup.reproduce.seed_003_path import CASES

SHOWN = ("rigid, viscous friction", "flexible, no friction", "flexible, viscous friction")


def path_figure() -> Figure:
    """Return the distance from the square over time, with the corners shaded."""
    t = lap().path.t
    at_corner = outside(lap().path.poses[:, :3, 3])[1]
    edges = np.flatnonzero(np.diff(at_corner.astype(int)))
    with drawing(9.0, 3.4) as plot:
        axis = plot.subplots()
        for start, end in edges.reshape(-1, 2):
            axis.axvspan(t[start], t[end], color=COLOURS[5], alpha=0.15, linewidth=0.0)
        for name in SHOWN:
            axis.plot(t, 1e3 * outside(drive_lap(CASES[name]))[0], label=name, linewidth=1.2)
        axis.set(xlabel="t [s]", ylabel="outside the square [mm]", xlim=(0.0, t[-1]))
        plot.legend(loc="outside upper center", ncols=len(SHOWN))
        return to_figure(
            plot,
            "Path test: horizontal distance of the flange from the square, outside positive, corners shaded. "
            "Robot, path and drives are assumed; the sizes stand for nothing.",
        )
