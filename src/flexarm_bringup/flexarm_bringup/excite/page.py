"""What a modal test did, for the page: the plan and the sensor check."""

from __future__ import annotations

import math
from collections.abc import Sequence

from flexarm_bringup.excite.plan import Plan
from flexarm_bringup.page.report import Cells, Column, Table
from flexarm_model.identification.sensor_check import Finding

PERCENT = 100.0


def plan_table(plan: Plan, axes: Sequence[str]) -> Table:
    """Return what was excited, and why so much."""
    signal, (low, high) = plan.excitation, plan.excitation.band_hz
    rows: list[Cells] = [[axis, float(peak)] for axis, peak in zip(axes, plan.amplitude, strict=True)]
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
    return Table("Excitation", [Column("axis"), Column("peak torque\n[N m] or [N]", ".4g")], rows, notes)


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
