"""The plots of the demo: what the tip did, how much is left, what the estimator knew, what it cost."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.demo_run.sessions import SessionRun
from flexarm_bringup.demo_run.study import SERVO, Outcome
from flexarm_bringup.page.figures import Figure, drawing, to_figure
from flexarm_bringup.residual import decibels
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

Array = NDArray[np.float64]
SHOWN_DEG = 30.0
FAR = 2.0  # times the largest torque: a limit beyond would make the curves flat
CURVES = ((SERVO, "A"), (SERVO, "B"), ("lqr", "A"), ("mpc", "A"), ("mpc", "ZVD"))


def draw_tip(study: Sequence[Outcome]) -> Figure:
    """Return the first figure of the page: what the tip does under each law."""
    return _tip(_shown(study))


def draw(study: Sequence[Outcome], sessions: Sequence[SessionRun]) -> list[Figure]:
    """Return the figures of the page."""
    geared = _shown(study)
    figures = [_tip(geared), _residual(study), _torque(geared)]
    recorded = next((o for run in sessions for o in run.outcomes if o.row.angle_deg == SHOWN_DEG), None)
    figures.insert(2, _modes(recorded or geared["mpc", "A"]))
    return figures


def _shown(study: Sequence[Outcome]) -> dict[tuple[str, str], Outcome]:
    return {(o.row.law, o.row.motion): o for o in study if _is_shown(o)}


def _is_shown(outcome: Outcome) -> bool:
    row = outcome.row
    return row.angle_deg == SHOWN_DEG and row.frequency_error == 0.0 and row.preset == "geared"


def _after_start(outcome: Outcome) -> Array:
    return np.asarray(outcome.slot.t - outcome.move.start)


def _off_goal_mm(outcome: Outcome) -> Array:
    """Return how far the tip is beyond its goal, across the arm [mm]."""
    goal, sign = outcome.move.goal, outcome.move.sign
    across = -np.sin(goal) * outcome.slot.tip[:, 0] + np.cos(goal) * outcome.slot.tip[:, 1]
    return np.asarray(1e3 * sign * across)


def _tip(outcomes: dict[tuple[str, str], Outcome]) -> Figure:
    with drawing(9.0, 4.4) as plot:
        left, right = plot.subplots(1, 2, width_ratios=(1, 2))
        for key in CURVES:
            t, distance = _after_start(outcomes[key]), _off_goal_mm(outcomes[key])
            left.plot(t, distance)
            right.plot(t, distance, label=outcomes[key].row.scheme)
        for axes in (left, right):
            axes.axvline(1.0, color="#888888", linewidth=0.8, linestyle=":")
            axes.set_xlabel("time since the start of the move [s]")
        left.set(xlim=(-0.1, 1.2), title="the move", ylabel="tip from its goal [mm]")
        right.set(xlim=(0.9, 2.6), ylim=(-12, 12), title="what is left (band: 0.5 mm)")
        right.axhspan(-0.5, 0.5, color="#888888", alpha=0.25, linewidth=0)
        plot.legend(*right.get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=8)
        caption = (
            f"Tip of the geared arm, {SHOWN_DEG:g} degrees in 1 s: its distance from the goal across the "
            "arm. The open-loop motions run on an ideal servo, which no motor is."
        )
        return to_figure(plot, caption)


def _residual(study: Sequence[Outcome]) -> Figure:
    """Draw the residual in dB over the frequency error, both hubs."""
    base = next(
        o.row.figures.residual for o in study if _is_shown(o) and (o.row.law, o.row.motion) == (SERVO, "A")
    )
    with drawing(9.0, 4.4) as plot:
        panels = plot.subplots(1, 2, sharey=True)
        for axes, preset in zip(panels, ("geared", "light_hub"), strict=True):
            for law, motion in CURVES:
                rows = [
                    o.row
                    for o in study
                    if (o.row.law, o.row.motion, o.row.angle_deg) == (law, motion, SHOWN_DEG)
                ]
                rows = sorted(
                    (r for r in rows if law == SERVO or r.preset == preset), key=lambda r: r.frequency_error
                )
                values = [decibels(row.figures.residual, base) for row in rows]
                axes.plot(
                    [100 * r.frequency_error for r in rows],
                    values,
                    marker="o",
                    markersize=4,
                    label=rows[0].scheme,
                )
            axes.set(title=preset.replace("_", " "), xlabel="real frequency, off the model by [%]")
        panels[0].set_ylabel("residual vibration [dB]")
        plot.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=8)
        caption = (
            f"RMS of the tip's acceleration after {SHOWN_DEG:g} degrees in 1 s, against the worst "
            "published trapezoid on an ideal servo; lower is stiller."
        )
        return to_figure(plot, caption)


def _modes(outcome: Outcome) -> Figure:
    """Draw the estimated modes with three sigma."""
    t, slot = _after_start(outcome), outcome.slot
    with drawing(9.0, 4.6) as plot:
        panels = plot.subplots(slot.eta.shape[1], 1, sharex=True, squeeze=False)[:, 0]
        for i, axes in enumerate(panels):
            eta, sigma = slot.eta[:, i], slot.eta_sigma[:, i]
            axes.fill_between(t, eta - 3 * sigma, eta + 3 * sigma, alpha=0.3, linewidth=0, label="3 sigma")
            axes.plot(t, eta, label="estimate")
            axes.set_ylabel(f"mode {i + 1}\n[kg$^{{1/2}}$ m]")
        panels[0].legend(fontsize=8, ncols=2)
        panels[-1].set_xlabel("time since the start of the move [s]")
        caption = f"Modes as the estimator saw them with {outcome.row.scheme} ({outcome.row.where})."
        return to_figure(plot, caption)


def _torque(outcomes: dict[tuple[str, str], Outcome]) -> Figure:
    """Draw the torques as large as they are; a limit far beyond them is told, not drawn."""
    config = load_config(find_manipulator("single_link"), "geared")
    limit = next(iter(config.actuated.values())).effort
    shown = [outcomes[key] for key in (("lqr", "A"), ("mpc", "A"), ("mpc", "ZVD"))]
    largest = max(float(abs(outcome.slot.tau[:, 0]).max()) for outcome in shown)
    is_near = limit < FAR * largest
    with drawing(9.0, 3.6) as plot:
        axes = plot.subplots()
        for outcome in shown:
            torque = outcome.move.sign * outcome.slot.tau[:, 0]
            axes.plot(_after_start(outcome), torque, label=outcome.row.scheme)
        for bound in (-limit, limit) if is_near else ():
            axes.axhline(bound, color="#c0392b", linewidth=1.0, linestyle="--")
        axes.set(xlabel="time since the start of the move [s]", ylabel="torque [N m]", xlim=(-0.1, 2.0))
        plot.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=8)
        told = "dashed" if is_near else f"not drawn: the largest torque is {largest:.2g} N m"
        return to_figure(plot, f"Torque at the joint, limit {limit:g} N m ({told}), geared hub.")
