"""The figures of ``flexarm compare``: what frequency errors cost, and how the tip comes to rest."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexarm_bringup.compare_laws.checks import base_of
from flexarm_bringup.compare_laws.judged import CompareResult
from flexarm_bringup.compare_laws.schemes import LAW_NAMES, LQR, MPC, PD, SERVO, WORST, Case
from flexarm_bringup.page.figures import Figure, drawing, to_figure
from flexarm_bringup.residual import decibels

SHAPERS_SHOWN = ("ZV", "ZVD", "EI")
SHOWN = 0.8  # s after the end of the motion
QUIET_MM = 1e-3  # lower end of the axis [mm]


def draw(case: Case, results: Sequence[CompareResult]) -> list[Figure]:
    """Return the figures of the first preset."""
    rows = [r for r in results if r.preset == results[0].preset and not r.is_scarce and r.has_ended]
    return [_robustness(case, rows, base_of(results)), _coming_to_rest(case, rows)]


def _robustness(case: Case, rows: Sequence[CompareResult], base: float) -> Figure:
    lines = [
        *((SERVO, name, ":") for name in (WORST, *SHAPERS_SHOWN, "best trapezoid")),
        (PD, case.chosen, "--"), (LQR, WORST, "--"), (MPC, WORST, "-"), (MPC, case.chosen, "-"),
    ]  # fmt: skip
    with drawing(9.0, 4.6) as plot:
        axes = plot.subplots()
        for law, motion, style in dict.fromkeys(lines):
            points = sorted(
                (100 * r.frequency_error, decibels(r.residual, base))
                for r in rows
                if (r.law, r.motion) == (law, motion)
            )
            if points:
                axes.plot(
                    *np.transpose(points),
                    style,
                    marker="o",
                    markersize=3,
                    label=f"{LAW_NAMES[law]}: {motion}",
                )
        axes.set(xlabel="real over described frequencies [%]", ylabel="residual [dB]")
        plot.legend(loc="outside lower center", ncols=3, fontsize=8)
        caption = (
            f"{case.task.manipulator}: vibration left when the real frequencies are not the described ones; "
            "0 dB: the worst profile on an ideal servo. Dotted: ideal servo, which no motor is."
        )
        return to_figure(plot, caption)


def _coming_to_rest(case: Case, rows: Sequence[CompareResult]) -> Figure:
    shown = dict.fromkeys(
        [(SERVO, WORST), (PD, WORST), (PD, case.chosen), (LQR, WORST), (MPC, WORST), (MPC, case.chosen)]
    )
    nominal = {(r.law, r.motion): r for r in rows if r.frequency_error == 0.0}
    with drawing(9.0, 3.8) as plot:
        axes = plot.subplots()
        for key in shown:
            if key in nominal:
                row = nominal[key]
                near = row.t <= SHOWN
                axes.semilogy(
                    row.t[near],
                    np.maximum(1e3 * row.off[near], QUIET_MM),
                    label=f"{LAW_NAMES[key[0]]}: {key[1]}",
                )
        axes.axhline(1e3 * case.task.watch.tolerance, color="#888888", linewidth=0.8, linestyle=":")
        axes.axvline(0.0, color="#888888", linewidth=0.8, linestyle=":")
        axes.set(xlabel="time since the end of the motion [s]", ylabel="tip off its goal [mm]")
        plot.legend(loc="outside lower center", ncols=3, fontsize=8)
        return to_figure(plot, f"{case.task.manipulator}: how the tip comes to rest, the arm as described.")
