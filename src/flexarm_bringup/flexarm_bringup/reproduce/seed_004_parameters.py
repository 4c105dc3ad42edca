"""Seed 004, tables 1 and 2: is what the description says what the paper prints?

Frames are the paper's: frame i lies at the far end of link i. The printed centres of mass of links 2 and 3
are taken from the joint (assumed), so the description's, which are from the far end, get the link's length.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import Cells, Column, Table
from flexarm_bringup.reproduce.reference import read_records
from flexarm_bringup.reproduce.seed_004_data import elbow_arm
from flexarm_bringup.reproduce.seed_004_matrices import SEED, RigidLinks
from flexarm_model.kinematics.dh import DhChain, DhRow
from flexarm_model.manipulator.body_spec import RigidBody

Array = NDArray[np.float64]

LINKS = ("link_1", "link_2", "link_3")
SAME = 1e-9  # relative: decimal numbers as both files have them
ZERO = 1e-15
POSES, DH_BOUND = 20, 1e-12  # random poses; m and 1
PER_DEGREE = np.degrees(1.0)  # N m/deg -> N m/rad
GROUPS = {  # of the checks: first letters of the symbols
    "lengths": "l",
    "masses": "m",
    "centres of mass": "XYZ",
    "moments of inertia": "I",
    "k and c": "kc",
}
UNITS = {"l": "m", "m": "kg", "X": "m", "Y": "m", "Z": "m", "I": "kg m²", "k": "N m/deg", "c": "N m s/rad"}
COLUMNS = (Column("symbol"), Column("unit"), Column("paper", "g"), Column("ours", "g"), Column("same"))


def parameter_table(arm: RigidLinks) -> tuple[Table, list[Check]]:
    """Return table 2 beside the description's values, and whether both tables are met."""
    printed, ours = printed_values(), described_values(arm)
    same = {
        symbol: math.isclose(ours[symbol], value, rel_tol=SAME, abs_tol=ZERO)
        for symbol, value in printed.items()
    }
    rows: list[Cells] = [
        [symbol, UNITS[symbol[0]], value, ours[symbol], same[symbol]] for symbol, value in printed.items()
    ]
    checks = []
    for name, letters in GROUPS.items():
        wrong = [symbol for symbol in printed if symbol[0] in letters and not same[symbol]]
        said = ", ".join(f"{symbol} {ours[symbol]:g} for {printed[symbol]:g}" for symbol in wrong)
        checks.append(Check(f"table 2: {name}", "as printed", said or "as printed", not wrong))
    notes = [
        "Units of inertias, k and c are assumed: the paper prints none.",
        "X2 and X3 are taken from the joint (assumed): the description has them from the far end.",
    ]
    title = "Table 2: the paper's parameters and the description's"
    return Table(title, COLUMNS, rows, notes), [*checks, frame_check(arm)]


def printed_values() -> dict[str, float]:
    """Return table 2 by symbol, in its order, in the units of ``UNITS``."""
    return {symbol: float(row["value"]) for symbol, row in read_records("seed004_table2").items()}


def described_values(arm: RigidLinks) -> dict[str, float]:
    """Return the same of the description."""
    lengths = (elbow_arm(arm.config).height, elbow_arm(arm.config).upper, elbow_arm(arm.config).fore)
    values: dict[str, float] = {}
    for i, (name, length, k, c) in enumerate(zip(LINKS, lengths, *arm.springs, strict=True), start=1):
        body = arm.config.bodies[name]
        assert isinstance(body, RigidBody)  # what the file says; narrows the type
        com = body.com + (0.0 if i == 1 else np.array([length, 0.0, 0.0]))
        values |= {f"l{i}": length, f"m{i}": body.mass, f"k{i}f": k / PER_DEGREE, f"c{i}f": c}
        values |= {f"{axis}{i}": x for axis, x in zip("XYZ", com, strict=True)}
        values |= {f"I{i}{2 * axis}": x for axis, x in zip("xyz", np.diag(body.inertia), strict=True)}
    return {symbol: float(value) for symbol, value in values.items()}


def frame_check(arm: RigidLinks) -> Check:
    """Return whether table 1 with the lengths of table 2 puts the tip's frame where the description does."""
    lengths, rows = printed_values(), []
    for record in read_records("seed004_table1_dh").values():
        a, d = (lengths[text] if text in lengths else float(text) for text in (record["a"], record["d"]))
        rows.append(DhRow(d, a, np.radians(float(record["alpha_deg"]))))
    chain, rng, off = DhChain(tuple(rows)), np.random.default_rng(SEED), 0.0
    for q in rng.uniform(-np.pi, np.pi, (POSES, len(rows))):
        off = max(off, float(abs(chain.pose(q) - arm.tree.tip_pose(arm.coordinates(q))).max()))
    name = f"table 1 (Denavit-Hartenberg) against the description, frame of the tip, {POSES} poses"
    return Check(name, f"≤ {DH_BOUND:g}", f"{off:.1e}", off <= DH_BOUND)
