"""Seed 000, table 1: are the strips' moduli and densities, of description and plane frame, as printed?"""

from __future__ import annotations

from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import Cells, Column, Table
from flexarm_bringup.reproduce.reference import read_reference
from flexarm_bringup.reproduce.seed_000_rig import RIG
from flexarm_model.manipulator.body_spec import Beam
from flexarm_model.manipulator.description import ManipulatorConfig

LEGS = (1, 2, 3)
STRIPS = {"first": RIG.first, "second": RIG.second}
COLUMNS = (
    Column("strip"),
    Column("E [GPa]\npaper", "g"),
    Column("\nours", "g"),
    Column("ρ [kg/m³]\npaper", "g"),
    Column("\nours", "g"),
)


def material_table(config: ManipulatorConfig) -> tuple[Table, list[Check]]:
    """Return table 1 beside the description's values, and whether every strip has them."""
    table = read_reference("seed000_table1")
    rows: list[Cells] = []
    wrong: list[str] = []
    for name, by_hand in STRIPS.items():
        printed = table[f"{name}_links"]
        wanted = printed["young_modulus_gpa"], printed["density_kg_m3"]
        ours = {f"{name}_{leg}": material(config, f"{name}_{leg}") for leg in LEGS}
        rows += [[strip, wanted[0], E, wanted[1], density] for strip, (E, density) in ours.items()]
        ours[f"{name} of the plane frame"] = (by_hand.E / 1e9, by_hand.density)
        wrong += [
            f"{strip} {E:g}, {density:g}" for strip, (E, density) in ours.items() if (E, density) != wanted
        ]
    found = "; ".join(wrong) or "as printed"
    check = Check("table 1: E and ρ of all strips", "as printed", found, not wrong)
    return Table("Table 1: materials of the strips", COLUMNS, rows), [check]


def material(config: ManipulatorConfig, strip: str) -> tuple[float, float]:
    """Return E [GPa] and density [kg/m^3] of the flexible piece of a strip, to six digits."""
    body = config.bodies[strip]
    assert isinstance(body, Beam)  # what the file says; narrows the type
    piece = next(piece for piece in body.pieces if not piece.rigid)
    return float(f"{piece.E / 1e9:.6g}"), float(f"{piece.density:.6g}")
