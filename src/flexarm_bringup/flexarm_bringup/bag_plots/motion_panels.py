"""Panels of what moved: the tip, the axes, the torques, goals of the tip."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.bag_plots.panel import QUIET, line, name_rows, reach, stacked, strip
from flexarm_bringup.bag_plots.series import BagSeries, constant_names
from flexarm_bringup.bag_plots.silence import is_silent
from flexarm_controller.motion.tip_kinematics import TipKinematics
from flexarm_controller.reference import Reference
from flexarm_model.settings.units import is_sliding
from flexarm_model.tree.reduced_tree import ReducedTree

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Plot

Array = NDArray[np.float64]
ASKED = 400  # instants at which the reference's tip is worked out
STILL = 1e-4  # m; a direction in which the tip moves less is not drawn
BALL = 0.5  # mm
STYLES = {"reference": "--", "estimate": "-", "truth": ":"}


def references(series: BagSeries, names: Sequence[str]) -> list[tuple[float, list[int], Reference]]:
    """Return the references of a bag that have points, in the order sent; those of other axes are left out.

    Args:
        series: The bag.
        names: Of the axes that are looked at.

    Returns:
        Of each when it was sent [s], which of the names its columns are, and itself.
    """
    found = []
    for msg, t in zip(series.messages("reference"), series.times("reference"), strict=True):
        points, told = [p for p in msg.points if len(p.positions)], list(msg.joint_names)
        if not points or len(set(told) & set(names)) != len(told) or len(points[0].positions) != len(told):
            continue
        since = [p.time_from_start.sec + 1e-9 * p.time_from_start.nanosec for p in points]
        theta = np.array([p.positions for p in points], float)
        theta_dot = np.array([p.velocities for p in points]) if len(points[0].velocities) else None
        reference = Reference.through(float(t) + np.array(since), theta, theta_dot)
        found.append((float(t), [list(names).index(name) for name in told], reference))
    return found


def asked(series: BagSeries, times: Array, names: Sequence[str]) -> Array:
    """Return what the references in force ask of axes, (k, n) in the order of their names.

    It is NaN before the first and for axes of which none tells, and (k, 0) where there is none.
    """
    sent = references(series, names)
    theta = np.full((times.size, len(names) if sent else 0), np.nan)
    for t, columns, reference in sent:
        after = np.flatnonzero(times >= t)
        theta[after[:, None], columns] = reference.sample(times[after])[0]
    return theta


def draw_tip(plot: Plot, series: BagSeries) -> None:
    """Draw the coordinates of the tip that change, and how far it is from where the reference wants it."""
    curves = {"estimate": (series.times("end_effector"), series.column("end_effector", _position))}
    if series.has("truth"):
        curves["truth"] = series.times("truth"), series.column("truth", lambda msg: msg.tip[:3])
    wanted = _wanted_tip(series)
    if wanted is not None:
        curves["reference"] = wanted
    moving = [i for i in range(3) if max(_range(y[:, i]) for _, y in curves.values()) > STILL]
    panels = stacked(plot, max(len(moving), 1) + (wanted is not None))
    for axes, i in zip(panels, moving or [0], strict=False):
        for name, (t, y) in curves.items():
            line(axes, t, y[:, i], label=name, linestyle=STYLES[name])
        axes.set_ylabel(f"{'xyz'[i]} [m]")
    panels[0].legend(fontsize=8, ncols=3)
    if wanted is not None:
        _draw_distance(panels[-1], curves)


def _draw_distance(axes: Any, curves: dict[str, tuple[Array, Array]]) -> None:
    t, wanted = curves["reference"]
    for name in ("estimate", "truth"):
        if name in curves:
            told, tip = curves[name]
            at = np.transpose([np.interp(t, told, tip[:, i]) for i in range(3)])
            distance = np.where(is_silent(told, t), np.nan, np.linalg.norm(at - wanted, axis=1))
            line(axes, t, 1e3 * distance, linestyle=STYLES[name])
    axes.axhspan(0.0, BALL, color="#888888", alpha=0.25, linewidth=0)
    axes.set_yscale("symlog", linthresh=BALL)
    axes.set_ylabel("off the\nreference [mm]")
    axes.set_ylim(bottom=0.0)


def _wanted_tip(series: BagSeries) -> tuple[Array, Array] | None:
    """Return where the reference's tip would rest, (k,) and (k, 3); None without reference or description."""
    if series.config is None or not references(series, names := tuple(series.config.actuated)):
        return None
    tip = TipKinematics(ReducedTree(series.config))
    times = np.linspace(max(series.times("reference")[0], 0.0), series.end, ASKED)
    theta = asked(series, times, names)
    is_told = np.isfinite(theta).all(axis=1)
    return times[is_told], np.array([tip.at_rest(each) for each in theta[is_told]])


def draw_joints(plot: Plot, series: BagSeries) -> None:
    """Draw every axis as measured and as asked for."""
    first = series.messages("joint_states")[0]
    t, theta = series.times("joint_states"), series.column("joint_states", lambda msg: msg.position)
    wanted = asked(series, t, first.name) if series.has("reference") else None
    for i, axes in enumerate(stacked(plot, len(first.name))):
        if i < theta.shape[1]:
            line(axes, t, theta[:, i], label="measured")
        if wanted is not None and i < wanted.shape[1]:
            line(axes, t, wanted[:, i], label="reference", linestyle="--")
        axes.set_ylabel(f"{first.name[i]}\n[{'m' if is_sliding(first.name[i]) else 'rad'}]")
        if i == 0 and axes.lines:
            axes.legend(fontsize=8, ncols=2)


def draw_torques(plot: Plot, series: BagSeries) -> None:
    """Draw what the guard let through to every motor, what the controller asked for, and the limits."""
    first = series.messages("applied_effort")[0]
    t, tau = series.times("applied_effort"), series.column("applied_effort", lambda msg: msg.effort)
    limits = [axis.effort for axis in series.config.actuated.values()] if series.config else []
    wanted = series.column("joint_commands", lambda msg: msg.effort)
    for i, axes in enumerate(stacked(plot, len(first.name))):
        if wanted.ndim == 2 and i < wanted.shape[1]:
            line(axes, series.times("joint_commands"), wanted[:, i], label="commanded", linestyle="--")
        if i < tau.shape[1]:
            line(axes, t, tau[:, i], label="applied")
            near = reach(axes, tau[:, i], limits[i]) if i < len(limits) else ""
            axes.set_title(near, fontsize=8, loc="right")
        axes.set_ylabel(f"{first.name[i]}\n[{'N' if is_sliding(first.name[i]) else 'N m'}]")
        if i == 0 and axes.lines:
            axes.legend(fontsize=8, ncols=2)


def draw_goals(plot: Plot, series: BagSeries) -> None:
    """Draw what became of the goals of the tip, and how far it was from them."""
    messages, t = series.messages("motion_status"), series.times("motion_status")
    names = constant_names(messages[0])
    top, bottom = plot.subplots(2, 1, sharex=True, height_ratios=(1, 3))
    colours: dict[str, str] = {}
    strip(top, 0, t, [names.get(msg.state, "?") for msg in messages], colours, holds=True)
    name_rows(top, ["goal"], colours)
    distance = 1e3 * series.column("motion_status", lambda msg: msg.distance)
    bottom.plot(t, distance, marker=".", linestyle="none")
    bottom.axhline(BALL, **QUIET)
    bottom.set_yscale("symlog", linthresh=BALL)
    bottom.set(xlabel="time [s]", ylabel="tip from its goal [mm]", ylim=(0.0, None))


def _range(y: Array) -> float:
    """Return how far apart the numbers of a signal lie; 0 where it has none."""
    known = y[np.isfinite(y)]
    return float(np.ptp(known)) if known.size else 0.0


def _position(msg: Any) -> list[float]:
    p = msg.pose.pose.position
    return [p.x, p.y, p.z]
