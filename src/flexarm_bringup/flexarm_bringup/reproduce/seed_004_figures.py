"""The plots of the page of seed 004."""

from __future__ import annotations

import numpy as np

from flexarm_bringup.page.figures import COLOURS, Figure, drawing, to_figure
from flexarm_bringup.reproduce.seed_004_data import Photographs
from flexarm_bringup.reproduce.seed_004_film import CAMERA, ORDER, RIGID, SPRINGS, Filmed
from flexarm_bringup.reproduce.seed_004_motion import Ramps, SpringArm, follow_exactly
from flexarm_bringup.reproduce.seed_004_photographs import null_tips, predict_left_out

BAR = 0.27  # width, of the distance between two poses
MARGIN = 0.1  # s, before and after the samples
AFTER_RAMP = (2.3, 3.6)  # s, around the end of the shoulder's ramp
READINGS = {"N m/deg, 2 bar": "", "N m/deg, 1 bar (assumed law)": "soft", "N m/rad, 2 bar": "rad"}


def error_figure(photos: Photographs) -> Figure:
    """Return the distance between tip and photograph, pose by pose."""
    tips = {
        "paper": photos.theory,
        "null": null_tips(photos),
        "calibrated, left out": predict_left_out(photos),
    }
    with drawing(9.0, 3.4) as plot:
        axis = plot.subplots()
        for i, (name, predicted) in enumerate(tips.items()):
            far = np.sqrt(np.nansum((predicted - photos.measured) ** 2, axis=1))
            axis.bar(
                np.arange(1, far.size + 1) + (i - 1) * BAR, far, BAR, label=name, color=COLOURS[(1, 4, 0)[i]]
            )
        axis.set(
            xlabel="pose of table 3", ylabel="tip error [mm]", ylim=(0, 12), xlim=(0, len(photos.names) + 1)
        )
        axis.set_xticks(range(1, len(photos.names) + 1))
        plot.legend(ncols=3, loc="outside upper center")
        return to_figure(
            plot,
            "Tip against photograph in the axes that the camera sees. Null: lengths and angles as "
            "printed (55 mm off in pose 26, where a minus is lost). Left out: lengths of the others.",
        )


def move_figure(filmed: Filmed) -> Figure:
    """Return the three filmed moves: samples, and models over time."""
    with drawing(9.0, 3.6) as plot:
        for axis, joint in zip(plot.subplots(1, 3), ORDER, strict=True):
            seen = filmed.film.joint == joint
            t = filmed.film.t[seen]
            for name, style in ((SPRINGS, "-"), (RIGID, "--"), (CAMERA, ":")):
                record = filmed.runs[name].record
                shown = (record.t > t[0] - MARGIN) & (record.t < t[-1] + MARGIN)
                axis.plot(record.t[shown], record.q_deg[shown, joint], style, label=name)
            axis.plot(t, filmed.theory_deg[seen], "s", markersize=4, label="paper's theory")
            axis.plot(t, filmed.measured_deg[seen], "o", markersize=4, label="experiment")
            axis.set(title=f"θ{joint + 1}", xlabel="t [s]")
        plot.axes[0].set_ylabel("angle [deg]")
        plot.legend(*plot.axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=5)
        return to_figure(
            plot,
            "The samples of table 4: springs and a rigid arm on the same ramps can hardly be told apart. "
            "“Camera”: ramps fitted to the experiment.",
        )


def unit_figure(ramps: Ramps) -> Figure:
    """Return the spring of the shoulder after its ramp under both units and at the softer pressure."""
    command = follow_exactly(ramps)
    shown = (command.t > AFTER_RAMP[0]) & (command.t < AFTER_RAMP[1])
    with drawing(9.0, 3.2) as plot:
        axis = plot.subplots()
        for name, preset in READINGS.items():
            bent = SpringArm(preset).follow(ramps).q_deg - command.q_deg
            axis.plot(command.t[shown], bent[shown, 1], label=name)
        axis.set(xlabel="t [s]", ylabel="link minus command [deg]")
        axis.legend()
        return to_figure(
            plot,
            "The shoulder at the end of its ramp: with N m/deg it overshoots and swings, as the paper "
            "reports; with N m/rad and the printed damping it cannot.",
        )
