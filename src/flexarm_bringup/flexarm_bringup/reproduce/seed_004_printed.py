"""Seed 004: what the printed equations give when they are taken at their word, beside the correct ones.

Each misprint here is read off the printed appendix (M), equations (9) to (12) (inverse kinematics) and (21)
(gravity); never used anywhere else. With the printed table 2, Y2 = Y3 = Z2 = Z3 = 0.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.page.report import Cells, Column, Table
from flexarm_bringup.reproduce.reference import read_records
from flexarm_bringup.reproduce.seed_004_data import Photographs, arm_config, elbow_arm, place_tips
from flexarm_bringup.reproduce.seed_004_matrices import RigidLinks

Array = NDArray[np.float64]

POSE_DEG = (0.0, 16.0, 0.0)
GRAVITY = 9.81  # m/s^2
COLUMNS = (Column("quantity"), Column("as printed", ".4g"), Column("correct", ".4g"), Column("what is wrong"))


def printed_table(photos: Photographs, arm: RigidLinks) -> Table:
    """Return misprints that can be evaluated, at q = (0, 16, 0) deg."""
    q = np.radians(POSE_DEG)
    M, G, appendix = arm.mass_matrix(q), arm.gravity(q), appendix_block(float(q[2]))
    over, distance = literal_inverse(photos)
    least = [float(np.linalg.eigvals(block).real.min()) for block in (appendix, M[1:, 1:])]
    intended = intended_block(float(q[2]))
    gravity = literal_gravity(q)
    rows: list[Cells] = [
        ["least eigenvalue of M over q2, q3 [kg m²]", *least, "M22 lacks a 2, M32 its brackets: indefinite"],
        ["M32 − M23 [kg m²]", float(appendix[1, 0] - appendix[0, 1]), 0.0, "M32 is dimensionally wrong"],
        ["M22, those put right [kg m²]", intended[0, 0], float(M[1, 1]), "l2 + X2 with X2 from joint 2"],
        ["M33, those put right [kg m²]", intended[1, 1], float(M[2, 2]), "l3 + X3 with X3 from joint 3"],
        ["G2 [N m]", gravity[0], float(G[1]), "masses at the ends of the links"],
        ["G3 [N m]", gravity[1], float(G[2]), "the same"],
        ["inverse: poses of 18 with |cos| > 1", over, 0, "l1 ignored, θ2 and θ3 exchanged"],
        ["inverse: mean tip error [mm]", distance, 0.0, "the same, cos cut at 1"],
    ]
    note = "M and G as printed contradict each other: M has the masses outside the links, G at their ends."
    return Table("The printed equations at their word", COLUMNS, rows, [note])


def appendix_block(q3: float) -> Array:
    """Return M22, M23; M32, M33 of the appendix as printed [kg m^2, where they have a unit], (2, 2)."""
    t, c3 = table_2(), np.cos(q3)
    a, b = t["l2"] + t["X2"], t["l3"] + t["X3"]
    M22 = t["I2zz"] + t["I3zz"] + t["m3"] * (b + t["l2"] * c3) ** 2 + t["m2"] * a**2 / 2
    M23 = t["I3zz"] + t["m3"] * b * (b + t["l2"] * c3)
    M32 = t["I3zz"] + t["m3"] * (2 * b + t["l2"] * c3) / 2
    return np.array([[M22, M23], [M32, t["I3zz"] + t["m3"] * b**2]])


def intended_block(q3: float) -> Array:
    """Return the same with factor and brackets put back, its arms still l + X [kg m^2], (2, 2)."""
    t, block = table_2(), appendix_block(q3)
    block[0, 0] += t["m2"] * (t["l2"] + t["X2"]) ** 2 / 2
    block[1, 0] = block[0, 1]
    return block


def literal_gravity(q: Array) -> tuple[float, float]:
    """Return G2 and G3 as printed [N m] at q [rad]."""
    t = table_2()
    upper, fore = t["l2"] * np.cos(q[1]), t["l3"] * np.cos(q[1] + q[2])
    return GRAVITY * (t["m3"] * (fore + upper) + t["m2"] * upper), GRAVITY * t["m3"] * fore


def literal_inverse(photos: Photographs) -> tuple[int, float]:
    """Return in how many of the front poses the printed inverse fails, and its mean tip error [mm]."""
    arm = elbow_arm(arm_config())
    tips = place_tips(arm, photos.signed_deg[:18]) / 1e3
    x, y, z = tips.T
    r = np.sqrt(x**2 + y**2 + z**2)
    cosine = (r**2 - arm.upper**2 - arm.fore**2) / (2 * arm.upper * arm.fore)
    second = np.arccos(np.clip(cosine, -1.0, 1.0))
    third = np.arcsin(z / r) + np.arctan(arm.fore * np.sin(second) / (arm.upper + arm.fore * np.cos(second)))
    found = place_tips(arm, np.degrees(np.column_stack([np.arctan(y / x), second, third])))
    return int((cosine > 1.0).sum()), float(np.linalg.norm(found - 1e3 * tips, axis=1).mean())


def table_2() -> dict[str, float]:
    """Return the printed parameters by symbol, as printed."""
    return {symbol: float(row["value"]) for symbol, row in read_records("seed004_table2").items()}
