"""What a modal test did, for the page: the plan and the sensor check."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from flexarm_bringup.excite.acted_excitation import SAME
from flexarm_bringup.excite.measure import MeasuredTest
from flexarm_bringup.page.report import Cells, Column, Table
from flexarm_model.identification.sensor_check import Finding

PERCENT = 100.0


def plan_table(tested: MeasuredTest) -> Table:
    """Return what was excited, why so much, and how much of it did not come in time."""
    plan, axes = tested.plan, tested.axes
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
    if plan.mirrored:
        notes.append(
            f"too fast for the rate, served modes show where there are none: {', '.join(plan.mirrored)}"
        )
    late = late_share(tested)
    if late:
        notes.append(
            f"in {PERCENT * late:.2g} % of the periods another excitation acted than was asked of them, as "
            "commands came late: periods differ, blocks leak, and ± does not know; a quieter machine helps"
        )
    return Table("Excitation", [Column("axis"), Column("peak torque\n[N m] or [N]", ".4g")], rows, notes)


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
