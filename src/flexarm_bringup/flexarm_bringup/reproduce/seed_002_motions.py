"""Seed 002, table 1: five motions per angle follow from one number, the period of the arm."""

from __future__ import annotations

import math

from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import Cells, Column, Table
from flexarm_bringup.reproduce.reference import column
from flexarm_bringup.reproduce.seed_002_data import Published
from flexarm_model.motion.profiles import Trapezoid

PERIOD = 1.0 / 5.23  # s, of the frequency the paper states
DIGITS = 4  # printed after the point
SHIFT = 10.0**DIGITS
HALF_UNIT = 0.5 / SHIFT
COLUMNS = (
    Column("case"),
    Column("θ [°]", ".0f"),
    Column("t_a [s]\nours", ".5f"),
    Column("\nprinted", ".4f"),
    Column("t_c [s]\nours", ".5f"),
    Column("t_d [s]\nours", ".5f"),
    Column("\nprinted", ".4f"),
    Column("ω_max [rad/s]\nours", ".5f"),
    Column("\nprinted", ".4f"),
    Column("remark"),
)


def motion_table(published: Published) -> tuple[Table, list[Check]]:
    """Return table 1 recomputed from period and angle, and whether it agrees."""
    rows: list[Cells] = []
    wrong: list[str] = []
    misprints: list[str] = []
    for case, printed in published.table1.items():
        theta_deg, t_a, t_d, omega = (
            column({case: printed}, name)[case]
            for name in ("theta_deg", "t_a_s", "t_d_printed_s", "omega_max_rad_s")
        )
        ours = Trapezoid.published(case[-1], math.radians(theta_deg), PERIOD)
        is_misprint = abs(ours.t_d - t_d) > HALF_UNIT
        remark = f"misprint: {t_d:.4f} gives ω_max {_omega(ours.theta, t_a, t_d):.4f}" if is_misprint else ""
        misprints += [case] * is_misprint
        agrees = _cut(ours.t_a) == t_a and abs(ours.omega_max - omega) <= HALF_UNIT
        wrong += [case] * (not agrees)
        times = [ours.t_a, t_a, ours.t_c, ours.t_d, t_d]
        rows.append([case, theta_deg, *times, ours.omega_max, omega, remark])
    notes = [
        "Rule: T = 1/5.23 Hz; cruise t_c = T (not printed); t_d = T/2, T … 5T/2; t_a = 1 s − T − t_d.",
        "The paper cuts t_a at four digits (0.71319 is printed 0.7131).",
    ]
    found = f"{len(rows) - len(wrong)} of {len(rows)}" + (f"; not {', '.join(wrong)}" if wrong else "")
    checks = [
        Check(
            "table 1: t_a and ω_max from T and θ, to the printed digits",
            f"{len(rows)} of {len(rows)}",
            found,
            not wrong,
        ),
        Check(
            "table 1: t_d to the printed digits but for the known misprint",
            "not C2A, C3A",
            f"not {', '.join(misprints)}",
            misprints == ["C2A", "C3A"],
        ),
    ]
    return Table("Table 1 recomputed: the motions", COLUMNS, rows, notes), checks


def _cut(value: float) -> float:
    return math.floor(value * SHIFT) / SHIFT


def _omega(theta: float, t_a: float, t_d: float) -> float:
    return theta / (1.0 - (t_a + t_d) / 2.0)
