"""What a modal test did, for the page: the plan and the sensor check."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from flexarm_bringup.excite.acted_excitation import SAME
from flexarm_bringup.excite.limited_torque import limited_share
from flexarm_bringup.excite.measure import MeasuredTest
from flexarm_bringup.page.report import Cells, Column, Table
from flexarm_model.identification.channel_findings import Finding

PERCENT = 100.0


def plan_table(tested: MeasuredTest) -> Table:
    """Return what was excited, why so much, and how much of it did not come in time."""
    plan, axes = tested.plan, tested.axes
    signal, (low, high) = plan.excitation, plan.excitation.band_hz
    torques = [np.column_stack([record.inputs[axis] for axis in axes]) for record in tested.records]
    peaks = np.max([abs(tau).max(axis=0) for tau in torques], axis=0)
    rows: list[Cells] = [
        [axis, float(added), float(peak)]
        for axis, added, peak in zip(axes, plan.amplitude, peaks, strict=True)
    ]
    notes = [
        f"{signal.name} from {low:.4g} to {high:.4g} Hz, {PERCENT * signal.share_in_band:.0f} % of its power "
        f"in the band, crest factor {signal.crest_factor:.2f} (a sine has 1.41)",
        f"lines {1 / signal.period:.4g} Hz apart: {len(plan.signs)} run(s) of {plan.skipped} + "
        f"{plan.periods} periods of {signal.period:.4g} s, {plan.seconds:.0f} s in all; the first let "
        "what begins die out, whole periods leak nothing",
        f"{plan.binding} binds: the model predicts {PERCENT * plan.used:.0f} % of what it leaves",
    ]
    if len(plan.signs) > 1:
        notes.append("all axes push in every run, with the signs of a Hadamard matrix")
    if plan.mirrored:
        notes.append(
            f"too fast for the rate, served modes show where there are none: {', '.join(plan.mirrored)}"
        )
    if limited := limited_part(tested):
        notes.append(
            f"in {PERCENT * limited:.2g} % of the periods a torque was at its limit or at that of its rate: "
            "there the guard changed what was asked for, and the arm did not move as a linear one; a smaller "
            "--share helps"
        )
    if late := late_share(tested):
        notes.append(
            f"in {PERCENT * late:.2g} % of the periods another excitation acted than was asked of them, as "
            "commands came late: periods differ, blocks leak, and ± does not know; a quieter machine helps"
        )
    heads = [
        Column("axis"), Column("torque added,\npeak [N m] or [N]", ".4g"),
        Column("torque of the drive,\npeak [N m] or [N]", ".4g"),
    ]  # fmt: skip
    return Table("Excitation", heads, rows, notes)


def limited_part(tested: MeasuredTest) -> float:
    """Return in what share of the recorded periods the guard limited a torque; 0 if no limit is told [1]."""
    plan, axes = tested.plan, tested.axes
    if not plan.effort:
        return 0.0
    shares = [
        limited_share(
            np.column_stack([record.inputs[axis] for axis in axes]),
            plan.effort, plan.effort_rate, 1.0 / record.rate_hz,
        )
        for record in tested.records
    ]  # fmt: skip
    return float(np.mean(shares))


def late_share(tested: MeasuredTest) -> float:
    """Return in what share of the recorded periods another excitation acted than was asked of them [1]."""
    others = []
    for run, record in enumerate(tested.records):
        acted = np.column_stack([record.instruments[axis] for axis in tested.axes])
        others.append((abs(acted - tested.plan.added(run)[-len(acted) :]) > SAME).any(axis=1))
    return float(np.mean(others)) if others else 0.0


def check_table(findings: Sequence[Finding], axes: Sequence[str]) -> Table:
    """Return the verdict on every channel."""
    heads = [
        Column("channel"), Column("verdict"), Column("noise\n[SI]", ".3g"), Column("described\n[SI]", ".3g"),
        *(Column(f"answer to\n{axis}", ".3g") for axis in axes),
        Column("likeness\nto the model", "+.2f"), Column("size over\nthe model's", ".2f"), Column("in words"),
    ]  # fmt: skip
    rows: list[Cells] = [
        [
            f.name, f.verdict, f.noise, f.described, *(float(value) for value in f.answers),
            _known(f.likeness), _known(f.gain), f.words,
        ]
        for f in findings
    ]  # fmt: skip
    return Table(
        "Sensor check",
        heads,
        rows,
        ["at rest, then one cycle near the slowest mode from every motor; answers are root mean squares, SI"],
    )


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None
