"""Seed 002: what the model says before any amplitude is fitted: frequencies, peaks, order of the cases."""

from __future__ import annotations

from collections.abc import Mapping

from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import Cells, Column, Table
from flexarm_bringup.reproduce.seed_002_data import CALIBRATIONS, ModalData, Records

STATED_F1_HZ = 5.23
WANTED_F1_HZ = (5.230, 5.249)  # with E = 208.5 GPa (fitted) and 210 GPa (printed); seed 002, section 3
PRINTED_PEAKS = {"C1A": 4.0, "C2A": 12.0, "C3A": 24.0}  # m/s^2, read in the text
PEAK_BOUND = 8.0  # %
FREQUENCY_COLUMNS = (
    Column("E [GPa]"),
    Column("f1 [Hz]", ".3f"),
    Column("f2", ".2f"),
    Column("f3", ".1f"),
    Column(f"f1 against {STATED_F1_HZ}", "+.2%"),
)
PEAK_COLUMNS = (
    Column("case"),
    Column("paper, about", ".0f"),
    Column("sim law", ".2f"),
    Column("exp law", ".2f"),
    Column("largest error", "+.1%"),
)


def frequency_table(fitted: ModalData, printed: ModalData) -> tuple[Table, list[Check]]:
    """Return the frequencies with the fitted and with the printed Young's modulus."""
    off = float(printed.f_hz[0]) / STATED_F1_HZ - 1.0
    rows: list[Cells] = [
        ["208.5 (fitted on f1)", *fitted.f_hz[:3].tolist(), None],
        ["210 (printed)", *printed.f_hz[:3].tolist(), off],
    ]
    seen = ", ".join(f"{value:+.4f}" for value in fitted.participation)
    notes = [
        f"The paper measures and simulates f1 = {STATED_F1_HZ} Hz. Only the row of 210 GPa predicts it.",
        f"Per unit hub acceleration the modes add {seen} m at the sensor, {fitted.sensor_radius:.3f} m out.",
    ]
    names = ("f1 with E = 208.5 GPa (fitted)", "f1 with E = 210 GPa (printed)")
    found = [round(float(data.f_hz[0]), 3) for data in (fitted, printed)]
    checks = [
        Check(name, f"{wanted:.3f} Hz", f"{value:.3f} Hz", value == wanted)
        for name, wanted, value in zip(names, WANTED_F1_HZ, found, strict=True)
    ]
    return Table("Frequencies with the hub locked", FREQUENCY_COLUMNS, rows, notes), checks


def peak_table(records: Records) -> tuple[Table, list[Check]]:
    """Return the peaks of case A, and whether the cases stand in the published order."""
    rows: list[Cells] = []
    worst = 0.0
    for case, printed in PRINTED_PEAKS.items():
        peaks = [records[key][case].peak for key in CALIBRATIONS]
        error = max((peak / printed - 1.0 for peak in peaks), key=abs)
        worst = max(worst, 100.0 * abs(error))
        rows.append([case, printed, *peaks, error])
    ours = {key: {case: item.rms for case, item in cases.items()} for key, cases in records.items()}
    ordered = [is_ordered(values, angle) for values in ours.values() for angle in "123"]
    checks = [
        Check("case A peaks", f"within {PEAK_BOUND:g} % of 4, 12, 24", f"{worst:.1f} %", worst <= PEAK_BOUND),
        Check(
            "order A > {C, E} > D > B of the RMS",
            f"{len(ordered)} of {len(ordered)} groups",
            f"{sum(ordered)} of {len(ordered)}",
            all(ordered),
        ),
    ]
    return Table("Peaks of the relative tip acceleration [m/s²], case A", PEAK_COLUMNS, rows), checks


def is_ordered(values: Mapping[str, float], angle: str) -> bool:
    """Return whether A > {C, E} > D > B within the group of an angle ("1", "2", "3")."""
    a, b, c, d, e = (values[f"C{angle}{letter}"] for letter in "ABCDE")
    return a > max(c, e) and min(c, e) > d > b
