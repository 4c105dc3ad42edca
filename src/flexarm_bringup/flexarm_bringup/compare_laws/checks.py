"""The acceptance bounds of a comparison. What cannot be judged for want of a row is not judged."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType

from flexarm_bringup.compare_laws.against_shapers import (
    REALISABLE,
    ROBUST_ERRORS,
    Rivalry,
    is_shaped,
    name_of,
    rivalries,
)
from flexarm_bringup.compare_laws.judged import CompareResult
from flexarm_bringup.compare_laws.schemes import LAW_NAMES, LQR, MPC, SERVO, WORST
from flexarm_bringup.page.check import Check
from flexarm_bringup.residual import decibels
from flexarm_bringup.tasks.task import Task

LITTLE_ELSE = 1.25  # of what noise leaves at rest, up to which a row is mostly noise


def base_of(results: Sequence[CompareResult]) -> float:
    """Return the residual that decibels refer to: the worst profile on the ideal servo, as described."""
    return next(r.residual for r in results if (r.law, r.motion, r.frequency_error) == (SERVO, WORST, 0.0))


def all_checks(
    task: Task, results: Sequence[CompareResult], noise: Mapping[float, float] = MappingProxyType({})
) -> list[Check]:
    """Return every bound that the rows allow to judge.

    Args:
        task: The bounds of its own.
        results: All rows.
        noise: What noise alone leaves under MPC at rest, by frequency error [m/s^2].
    """
    base, first = base_of(results), results[0].preset
    rows = [r for r in results if r.preset == first and not r.is_scarce]
    scarce = [r for r in results if r.preset == first and r.is_scarce]
    return [
        *_gains(task, rows, base),
        *_against_shapers(rows, noise),
        *_stopped(rows),
        *_scarce(task, scarce),
        *_other_presets(task, results, base),
    ]


def _gains(task: Task, rows: Sequence[CompareResult], base: float) -> list[Check]:
    nominal = [r for r in rows if r.law == MPC and r.frequency_error == 0.0]
    worst = [r.residual for r in nominal if r.motion == WORST]
    other = [r.residual for r in nominal if r.motion != WORST]  # the one that the moves file chooses, too
    wanted = [
        ("MPC on the worst profile", worst, task.compare.worst_db),
        ("MPC on a shaped reference", other, task.compare.shaped_db),
    ]
    return [
        at_most(name, decibels(min(found), base), bound, "dB")
        if found
        else Check(name, f"at most {bound:g} dB", "none: no such row has ended", False)
        for name, found, bound in wanted
        if bound is not None
    ]


def _against_shapers(rows: Sequence[CompareResult], noise: Mapping[float, float]) -> list[Check]:
    """Return whether MPC leaves no more than the best shaper that is realisable; see ``against_shapers``.

    Where whoever follows the shapers was stopped on all of them there is nothing to hold MPC against: missed.
    """
    judged = [rivalry for rivalry in rivalries(rows) if rivalry.law == REALISABLE]
    checks = [Check(r.name, "at most 0 dB", r.text + _of_noise(r, noise), r.gap <= 0.0) for r in judged]
    for error in ROBUST_ERRORS:
        at = [r for r in rows if r.law == REALISABLE and r.frequency_error == error and is_shaped(r.motion)]
        if at and not any(r.has_ended for r in at):
            found = f"none: {LAW_NAMES[REALISABLE]} was stopped"
            checks.append(Check(name_of(REALISABLE, (error,)), "at most 0 dB", found, False))
    return checks


def _of_noise(rivalry: Rivalry, noise: Mapping[float, float]) -> str:
    """Return that MPC leaves little but noise, where it does: there a bound is met or missed by the draw."""
    alone = max((noise.get(error, 0.0) for error in rivalry.errors), default=0.0)
    is_noise = rivalry.mpc <= LITTLE_ELSE * alone
    return f"; of MPC's {rivalry.mpc:.4f} noise alone leaves {alone:.4f}, see --seed" if is_noise else ""


def _stopped(rows: Sequence[CompareResult]) -> list[Check]:
    """Return a missed bound where MPC was stopped: a row that is left out of the others cannot miss them."""
    stopped = [r for r in rows if r.law == MPC and not r.has_ended]
    return [Check("MPC is never stopped", "0", f"{len(stopped)}", False)] if stopped else []


def _scarce(task: Task, rows: Sequence[CompareResult]) -> list[Check]:
    bound, by_law = task.compare.scarce_gain_db, {r.law: r for r in rows if r.frequency_error == 0.0}
    if bound is None or not {LQR, MPC} <= by_law.keys():
        return []
    name = "half the torque beyond the weight: MPC's gain on the clipped LQG"
    stopped = ", ".join(LAW_NAMES[law] for law in (LQR, MPC) if not by_law[law].has_ended)
    if stopped:
        return [Check(name, f"at least {bound:g} dB", f"none: {stopped} was stopped", False)]
    gain = decibels(by_law[LQR].residual, by_law[MPC].residual)
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
