"""The acceptance bounds of a comparison. What cannot be judged for want of a row is not judged."""

from __future__ import annotations

import math
from collections.abc import Sequence

from flexarm_bringup.compare_laws.judged import CompareResult
from flexarm_bringup.compare_laws.open_loop_motions import SHAPERS
from flexarm_bringup.compare_laws.schemes import LAW_NAMES, LQR, MPC, PD, SERVO, WORST
from flexarm_bringup.report import Check
from flexarm_bringup.residual import decibels
from flexarm_bringup.task import Task

ROBUST_ERRORS = (-0.10, 0.10)


def is_shaped(motion: str) -> bool:
    """Tell whether a motion of that name is a shaped one."""
    return motion.split(",")[0] in SHAPERS


def base_of(results: Sequence[CompareResult]) -> float:
    """Return the residual that decibels refer to: the worst profile on the ideal servo, as described."""
    return next(r.residual for r in results if (r.law, r.motion, r.frequency_error) == (SERVO, WORST, 0.0))


def all_checks(task: Task, results: Sequence[CompareResult]) -> list[Check]:
    """Return every bound that the rows allow to judge."""
    base, first = base_of(results), results[0].preset
    rows = [r for r in results if r.preset == first and not r.is_scarce]
    scarce = [r for r in results if r.preset == first and r.is_scarce]
    return [
        *_gains(task, rows, base),
        *_against_shapers(rows),
        *_scarce(task, scarce),
        *_other_presets(task, results, base),
    ]


def _gains(task: Task, rows: Sequence[CompareResult], base: float) -> list[Check]:
    nominal = [r for r in rows if r.law == MPC and r.frequency_error == 0.0]
    worst = [r.residual for r in nominal if r.motion == WORST]
    shaped = [r.residual for r in nominal if is_shaped(r.motion)]
    wanted = [
        ("MPC on the worst profile", worst, task.compare.worst_db),
        ("MPC on a shaped reference", shaped, task.compare.shaped_db),
    ]
    return [
        at_most(name, decibels(min(found), base), bound, "dB")
        for name, found, bound in wanted
        if found and bound
    ]


def _against_shapers(rows: Sequence[CompareResult]) -> list[Check]:
    """Return whether MPC leaves no more than the best shaper at frequency errors.

    Once for each sign, with the best of all rows for that sign; once for the rows that are best at the worse
    of both signs, for nobody knows the sign when a shaper is chosen.
    """
    checks = []
    for law in (SERVO, PD):
        for errors in (*((error,) for error in ROBUST_ERRORS), ROBUST_ERRORS):
            mpc = _worst_of(rows, MPC, errors)
            shapers = {m: left for m, left in _worst_of(rows, law, errors).items() if is_shaped(m)}
            if mpc and shapers:
                rival = min(shapers, key=lambda motion: shapers[motion])
                found = decibels(min(mpc.values()), shapers[rival])
                text = f"{found:+.1f} dB ({rival}: {shapers[rival]:.4f} m/s²)"
                signs = " and ".join(f"{100 * error:+.0f}" for error in errors)
                name = f"f {signs} %: better MPC row over the best shaper, {LAW_NAMES[law]}"
                checks.append(Check(name, "at most 0 dB", text, found <= 0.0))
    return checks


def _worst_of(rows: Sequence[CompareResult], law: str, errors: Sequence[float]) -> dict[str, float]:
    """Return the worst residual at these errors by motion, where there is one at each [m/s^2]."""
    found: dict[str, list[float]] = {}
    for row in rows:
        if row.law == law and row.legs and row.frequency_error in errors:
            found.setdefault(row.motion, []).append(row.residual)
    return {motion: max(left) for motion, left in found.items() if len(left) == len(errors)}


def _scarce(task: Task, rows: Sequence[CompareResult]) -> list[Check]:
    bound, by_law = task.compare.scarce_gain_db, {r.law: r for r in rows if r.frequency_error == 0.0}
    if bound is None or not {LQR, MPC} <= by_law.keys():
        return []
    gain = decibels(by_law[LQR].residual, by_law[MPC].residual)
    name = "half the worst profile's peak torque: MPC's gain on the clipped LQG"
    return [Check(name, f"at least {bound:g} dB", f"{gain:.1f} dB", gain >= bound)]


def _other_presets(task: Task, results: Sequence[CompareResult], base: float) -> list[Check]:
    checks = []
    for preset, bound in task.compare.other_presets_db.items():
        rows = [r for r in results if r.preset == preset and r.law == MPC]
        off = [r for r in rows if r.frequency_error in ROBUST_ERRORS]
        if off:
            worst = max(off, key=lambda r: r.residual)
            name = f"{preset.replace('_', ' ')}: worst MPC row at f ±10 %"
            checks.append(at_most(name, decibels(worst.residual, base), bound, "dB"))
            stopped = [r for r in rows if r.stopped]
            checks.append(
                Check(
                    f"{preset.replace('_', ' ')}: MPC is never stopped", "0", f"{len(stopped)}", not stopped
                )
            )
    return checks


def at_most(name: str, found: float, bound: float, unit: str) -> Check:
    """Return the check that a number is at most so much."""
    text = f"{found:.3g} {unit}" if math.isfinite(found) else "never"
    return Check(name, f"at most {bound:g} {unit}", text, found <= bound)
