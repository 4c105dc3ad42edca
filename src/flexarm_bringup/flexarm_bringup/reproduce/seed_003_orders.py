"""Seed 003: how far the reduced models lie from the full one and from each other, in decibels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import Cells, Column, Table
from flexarm_bringup.reproduce.seed_003_data import (
    DESCRIPTIONS,
    HIGH_HZ,
    LOW_HZ,
    POSES,
    Deviation,
    deviation,
    model_at,
    responses,
)
from flexarm_bringup.reproduce.seed_003_golden import locked_hz

TOP_HZ = 1000.0
BANDS = ((LOW_HZ, HIGH_HZ), (HIGH_HZ, 300.0), (300.0, TOP_HZ))  # Hz
NOTES = {  # mean dB against the full model at mid; seed 003, section 4
    "guyan": (0.10, 2.4, 4.8),
    "cb_500": (0.00, 0.07, 1.8),
    "cb_1000": (0.00, 0.07, 1.6),
    "six_axis": (5.5, 4.8, 10.0),
    "lumped": (5.5, 4.8, 10.0),
    "rigid": (7.1, 11.5, 14.5),
}
GUYAN_BOUNDS = (0.3, 0.8)  # dB: at most in 4-100 Hz, at least in 100-150 Hz
CB_BOUNDS = (0.05, 0.3)  # dB: at most below 300 Hz, at least above


@dataclass(frozen=True)
class Partings:
    """How far the reductions lie apart, mean deviations [dB]; of three poses the one that speaks against it.

    Attributes:
        below, above: Guyan against CB-1000 in 4-100 Hz (largest) and in 100-150 Hz (least).
        same, differ: CB-500 against CB-1000 below 300 Hz (largest) and above (least).
        diagonal, other: Guyan against CB-1000 in 100-300 Hz, on (largest) and off the diagonal (least).
    """

    below: float
    above: float
    same: float
    differ: float
    diagonal: float
    other: float


@cache
def partings() -> Partings:
    """Return where the reductions part."""
    guyan, cb = ([_apart(name, pose) for pose in POSES] for name in ("guyan", "cb_500"))
    return Partings(
        max(part(LOW_HZ, HIGH_HZ).mean for part in guyan),
        min(part(HIGH_HZ, 150).mean for part in guyan),
        max(part(LOW_HZ, 300).mean for part in cb),
        min(part(300, TOP_HZ).mean for part in cb),
        max(part(HIGH_HZ, 300).diagonal for part in guyan),
        min(part(HIGH_HZ, 300).off_diagonal for part in guyan),
    )


def deviation_table() -> tuple[Table, list[Check]]:
    """Return the mean deviations of all models from the full one at mid."""
    full = responses("full", "mid", TOP_HZ)
    rows: list[Cells] = []
    for name, noted_values in NOTES.items():
        cells: Cells = [DESCRIPTIONS[name], model_at(name, "mid").n]
        for band, noted in zip(BANDS, noted_values, strict=True):
            found = deviation(responses(name, "mid", TOP_HZ), full, *band)
            cells += [noted, found.mean, found.diagonal, found.off_diagonal]
        rows.append(cells)
    columns = [Column("model"), Column("DOF", "d")]
    for low, high in BANDS:
        columns += [
            Column(f"{low:g}–{high:g} Hz\nnotes", ".2f"),
            Column("\nours", ".2f"),
            Column("\ndiagonal", ".2f"),
            Column("\nother", ".2f"),
        ]
    notes = [
        "Mean of |20 log10(|H|/|H_full|)| over 36 curves and lines 1, 4 and 10 Hz apart in the three bands.",
        "Null: rigid links on gear springs, the last row.",
    ]
    return Table("Deviation of the motors' responses from the full model, mid [dB]", columns, rows, notes), []


def reduction_table() -> tuple[Table, list[Check]]:
    """Return where the reductions of the links part, at three poses."""
    guyan = {pose: _apart("guyan", pose) for pose in POSES}
    cb = {pose: _apart("cb_500", pose) for pose in POSES}
    rows: list[Cells] = [
        ["Guyan against CB-1000", "4–50", "≤ 0.03", *(guyan[p](4, 50).mean for p in POSES)],
        ["", "50–100", "≤ 0.24", *(guyan[p](50, 100).mean for p in POSES)],
        ["", "100–150", "1.0–1.4", *(guyan[p](100, 150).mean for p in POSES)],
        ["", "150–300", "2.8–3.0", *(guyan[p](150, 300).mean for p in POSES)],
        ["  its diagonal", "100–300", "≤ 0.03", *(guyan[p](100, 300).diagonal for p in POSES)],
        ["  off its diagonal", "100–300", "2.8–3.1", *(guyan[p](100, 300).off_diagonal for p in POSES)],
        ["CB-500 against CB-1000", "4–300", "≤ 0.02", *(cb[p](4, 300).mean for p in POSES)],
        ["", "300–1000", "0.5–0.9", *(cb[p](300, TOP_HZ).mean for p in POSES)],
    ]
    found = partings()
    checks = [
        _bound("Guyan against CB-1000, 4–100 Hz, worst pose", found.below, GUYAN_BOUNDS[0], most=True),
        _bound("Guyan against CB-1000, 100–150 Hz, every pose", found.above, GUYAN_BOUNDS[1], most=False),
        _bound("CB-500 against CB-1000, below 300 Hz, worst pose", found.same, CB_BOUNDS[0], most=True),
        _bound("CB-500 against CB-1000, above 300 Hz, every pose", found.differ, CB_BOUNDS[1], most=False),
    ]
    columns = [
        Column("models"),
        Column("band [Hz]"),
        Column("notes [dB]"),
        *(Column(p, ".3f") for p in POSES),
    ]
    notes = [
        "By construction: bracket and tail of the assumed robot put link modes below 1 kHz. "
        "Beams alone would not part below 1 kHz: the paper's 100 and 300 Hz are not predicted here.",
        f"Locked modes below {HIGH_HZ:g} Hz: Guyan within {frequency_gap():.2f} % of CB-1000 (notes 0.9 %).",
    ]
    return Table("Where the reductions part, mean deviation [dB]", columns, rows, notes), checks


def frequency_gap() -> float:
    """Return the largest difference of the locked modes below 100 Hz, Guyan against CB-1000 [%]."""
    worst = 0.0
    for pose in POSES:
        fine = locked_hz(model_at("cb_1000", pose))
        n = int((fine < HIGH_HZ).sum())
        worst = max(worst, float(abs(locked_hz(model_at("guyan", pose))[:n] / fine[:n] - 1).max()))
    return 100 * worst


def _apart(name: str, pose: str) -> Callable[[float, float], Deviation]:
    """Return the deviation from CB-1000 as a function of the band."""
    frf, reference = responses(name, pose, TOP_HZ), responses("cb_1000", pose, TOP_HZ)
    return lambda low, high: deviation(frf, reference, low, high)


def _bound(name: str, found: float, bound: float, *, most: bool) -> Check:
    good = found <= bound if most else found >= bound
    return Check(name, f"{'≤' if most else '≥'} {bound} dB", f"{found:.3f} dB", good)
