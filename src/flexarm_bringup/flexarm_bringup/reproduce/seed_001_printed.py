"""Seed 001, what follows from the paper's own numbers: half-power readings, table 1, the milling force."""

from __future__ import annotations

from dataclasses import dataclass

from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import Cells, Column, Table
from flexarm_bringup.reproduce.reference import column, read_records, read_reference
from flexarm_model.modal.half_power import HalfPower

AGREES = 0.005  # relative: what rounding a printed damping ratio to three digits does
PROSE_HEIGHT = 0.052e-3  # m/N at the simulated tool, against the 0.045 mm that its k needs
FORCE = (1081.7, 826.8)  # N, seed 001, section 5: as printed, and with width and depth exchanged
READING_COLUMNS = (
    Column("case"),
    Column("f0\n[Hz]", "g"),
    Column("fa, fb\n[Hz]"),
    Column("H0\n[mm/N]", "g"),
    Column("ζ\nprinted", ".4f"),
    Column("\nrecomputed", ".5f"),
    Column("k [N/m]\nprinted", ".3g"),
    Column("\nrecomputed", ".4g"),
    Column("verdict"),
)
ERROR_COLUMNS = (
    Column("mode at point"),
    Column("sim [Hz]", "g"),
    Column("exp [Hz]", "g"),
    Column("error [%]\nprinted", "g"),
    Column("\nrecomputed", ".2f"),
    Column("of the simulation", ".2f"),
)
FORCE_COLUMNS = (Column("cutting force"), Column("seed 001 [N]", ".1f"), Column("ours [N]", ".1f"))


@dataclass(frozen=True)
class Reading:
    """A printed block: what was read off a curve, and what the paper makes of it.

    Attributes:
        curve: Frequencies [Hz] and height [m/N] as read.
        zeta, stiffness: Printed damping ratio [1] and modal stiffness [N/m].
    """

    curve: HalfPower
    zeta: float
    stiffness: float

    @property
    def verdict(self) -> str:
        """What is wrong with the printed numbers, found from themselves."""
        found = []
        if not _agree(self.zeta, self.curve.zeta):
            found.append(f"ζ wrong, needs a band of {2 * self.zeta * self.curve.f_hz:.2f} Hz")
        if not _agree(self.stiffness, self.curve.stiffness):
            without = 1 / (self.curve.height * self.zeta)
            is_doubled = _agree(self.stiffness, without)
            found.append("k = 1/(H0 ζ): the factor 2 is missing" if is_doubled else "k wrong")
        return "; ".join(found) or "consistent"


def read_printed() -> dict[str, Reading]:
    """Return the four blocks of the paper by case."""
    blocks = {}
    for case, row in read_records("seed001_half_power").items():
        f_0, low, high = (float(row[name]) for name in ("f0_hz", "fa_hz", "fb_hz"))
        curve = HalfPower(f_0, low, high, 1e-3 * float(row["h0_mm"]))
        blocks[case] = Reading(curve, float(row["printed_zeta"]), float(row["printed_k_n_per_m"]))
    return blocks


def reading_table() -> tuple[Table, list[Check]]:
    """Return the printed damping and stiffness recomputed from the printed readings."""
    records = read_records("seed001_half_power")
    rows: list[Cells] = []
    wrong = []
    for case, block in read_printed().items():
        curve, record = block.curve, records[case]
        band = f"{curve.low_hz:g}, {curve.high_hz:g}"
        ours = [block.zeta, curve.zeta, block.stiffness, curve.stiffness]
        is_whole = "RECONSTRUCTED" not in record["verdict"]
        name = _words(case) if is_whole else f"{_words(case)} (reconstructed)"
        rows.append([name, curve.f_hz, band, 1e3 * curve.height, *ours, block.verdict])
        same = (f"{curve.zeta:.5f}", f"{curve.stiffness:.3e}")
        wanted = (record["recomputed_zeta"], f"{float(record['recomputed_k_n_per_m']):.3e}")
        wrong += [case] * (same != wanted)
    notes = [f"{_words(case)}: {record['verdict']}." for case, record in records.items()]
    notes += ["k is the stiffness per unit force: H0 is printed in mm and used as mm/N.", *_if_displacement()]
    found = f"{len(rows) - len(wrong)} of {len(rows)}"
    check = Check("half-power table: ζ and k recomputed, every digit", "4 of 4", found, not wrong)
    return Table("Half-power readings of the paper recomputed", READING_COLUMNS, rows, notes), [check]


def error_table() -> tuple[Table, list[Check]]:
    """Return the errors of table 1 recomputed."""
    table = read_reference("seed001_table1")
    rows: list[Cells] = []
    off = 0.0
    for point in table:
        for mode in ("f1", "f2"):
            sim, exp, printed, wanted = (
                column(table, name)[point]
                for name in (
                    f"sim_{mode}_hz",
                    f"exp_{mode}_hz",
                    f"printed_error_{mode}_percent",
                    f"true_error_{mode}_percent",
                )
            )
            error = 100.0 * (exp - sim) / exp
            off = max(off, abs(round(error, 2) - wanted))
            rows.append([f"{mode} at the {point}", sim, exp, printed, error, 100.0 * (exp - sim) / sim])
    notes = [
        "Error: (exp − sim) / exp. The same pair 96/105 is printed as 8.5 at one point and 9.5 at the other.",
        "f2 at the platform: 133 against 129 is 3.01 %; the printed 3.75 is wrong.",
    ]
    check = Check("table 1: errors recomputed", "8.57, 3.73, 8.57, 3.01 %", f"{off:.2f} off", off < 0.005)
    return Table("Table 1 recomputed: sim against experiment", ERROR_COLUMNS, rows, notes), [check]


def force_table() -> tuple[Table, list[Check]]:
    """Return the milling force, and what exchanging width and depth of cut makes of it."""
    values = milling_force(width_mm=12.0, depth_mm=2.0), milling_force(width_mm=2.0, depth_mm=12.0)
    names = ("width 12 mm, depth 2 mm, as printed", "width and depth exchanged")
    rows: list[Cells] = [[name, w, v] for name, w, v in zip(names, FORCE, values, strict=True)]
    notes = [
        "F_t = 808 · 12^1.1 · 0.1^0.8 · 16^−1.1 · 2^0.95 · 6; the paper prints neither unit nor result.",
        "The paper writes the depth of cut as a_n and as a_p.",
    ]
    found = [round(value, 1) for value in values]
    check = Check("F_t; exchanged", "{} / {} N".format(*FORCE), "{} / {} N".format(*found), found == [*FORCE])
    return Table("Equation (14): the milling force", FORCE_COLUMNS, rows, notes), [check]


def milling_force(width_mm: float, depth_mm: float) -> float:
    """Return equation (14) [N]: 0.1 mm per tooth, 16 mm cutter, 6 teeth."""
    return float(808.0 * width_mm**1.1 * 0.1**0.8 * 16.0**-1.1 * depth_mm**0.95 * 6.0)


def _if_displacement() -> list[str]:
    curve = read_printed()["sim_tool"].curve
    prose = HalfPower(curve.f_hz, curve.low_hz, curve.high_hz, PROSE_HEIGHT)
    absurd = HalfPower(curve.f_hz, curve.low_hz, curve.high_hz, PROSE_HEIGHT / FORCE[0])
    return [
        f"With the 0.052 mm of the prose k at the simulated tool would be {prose.stiffness:.3g} N/m.",
        f"Taken as displacements under F_t, k would be {absurd.stiffness:.2g} N/m, "
        f"the modal mass {absurd.mass:.0f} kg.",
        "One mode cannot have ζ .0232 and .0279 at two points; .0130 and .0150 differ by the reading.",
    ]


def _words(case: str) -> str:
    return case.replace("_", " ")


def _agree(printed: float, recomputed: float) -> bool:
    return abs(printed / recomputed - 1.0) <= AGREES
