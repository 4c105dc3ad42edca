"""Seed 004, the arm with variable-stiffness links: the paper's tables against this model, misprints and all.

Order of reading: parameters (tables 1 and 2), photographed poses (table 3), their averages, what calibrated
lengths are worth, mass matrix and gravity, unit of the stiffness, filmed moves (table 4), printed equations.
"""

from __future__ import annotations

import math

from flexarm_bringup.page.check import Check
from flexarm_bringup.page.figures import Figure
from flexarm_bringup.page.report import Page, Table
from flexarm_bringup.reproduce.seed_004_data import arm_config, read_photographs
from flexarm_bringup.reproduce.seed_004_film import SPRINGS, run_all, sample_table, skill_table
from flexarm_bringup.reproduce.seed_004_matrices import (
    RigidLinks,
    golden_table,
    inverse_check,
    mode_checks,
    mode_table,
)
from flexarm_bringup.reproduce.seed_004_parameters import (
    SAME,
    described_values,
    parameter_table,
    printed_values,
)
from flexarm_bringup.reproduce.seed_004_photographs import average_table, theory_table
from flexarm_bringup.reproduce.seed_004_photographs import skill_table as length_table
from flexarm_bringup.reproduce.seed_004_printed import printed_table

TITLE = "Seed 004, the arm with variable-stiffness links: published tables against this model"
LEAD = (
    "Three joints and two inflated links at 2 bar, photographed in 26 poses and filmed in three moves; the "
    "model is three rigid links, each on a spring and a damper about the angle that its servo commands."
)
FITTED = (
    "l2 = 295 mm of table 3 (preset table_3), on its printed theory",
    "40.25 / 295.2 / 236.6 mm (preset calibrated), on the measured poses of table 3",
    "ramps 46.5, 49, 29 °/s to −43, 15.90, −44.975° and their starts, on the printed theory of table 4",
    "ramps fitted to the camera: rates and starts, on the measured tips of table 4",
)
ERRATA = (
    "Table 2: labels Z3, Y4 stand for Z2, Z3; units of k, c, I are missing; l2 = 290, table 3 used 295.",
    "θ3 = 6.6 in poses 19 to 26 lost its minus: pose 26 is 54.8 mm off in z with +6.6.",
    "Pose 24: measured azimuth 11.04°, printed θ1 10.56°. Pose 4: z error 2.50, printed 2.57. "
    "Pose 26: z error 0.35, printed 0.1225 = 0.35².",
    "The average z error 2.40 mm belongs to poses 1 to 18 (2.38), if anywhere; all 19 give 2.28.",
    "Equations (9) to (12): l1 ignored, θ2 and θ3 exchanged, elbow branches mixed, atan for atan2.",
    "Equations (2), (3), (5): wrong rows (0 1 0 l1, 0 0 1 0 and 0 0 0 1 are right); (1) has T23 for T32.",
    "M and G contradict each other: M with arms l + X, G with the masses at the ends of the links.",
    "Appendix: M11 has I2yy for I1yy and Z3 for Z1; M22, M21, M31 lack factors; M32 lost its brackets; "
    "C11: sin q2 for sin 2q2, a doubled sin(2q2+2q3), S3 for C3; C21: I3zz for I3xx, m3 Y2 for m2 Y2.",
    "The kinetic energy prints one term twice in place of I3xx q1'² S23² / 2; the potential "
    "uses the wrong axis and l2 S2 for (l2 + X2) S2; the prose has L = P − K.",
    "Table 4: sample 19 copies 11; theory x of 26 is off its circle (491.11 for 481.98); the printed errors "
    "of 22, 23, 24, 26 are not those of their columns; sample 11, printed at 4 s, is at 4.10 s.",
    "Most minus signs, roots and exponents are lost in the available text: a missing minus proves nothing.",
)
NOT_CLAIMED = (
    "that k or c is validated or identified; coupling between the joints",
    "the whole-run figures 0.63 / 1.06 / 1.27° and 6.24 / 6.4 / 2.93 mm, which need figures 16 to 19",
    "a law of stiffness over pressure: the file's is assumed, for demonstration",
    "agreement of the printed appendix with anything",
)


def main(figures: bool = False) -> Page:
    """Compute everything and return it as a page.

    Args:
        figures: Whether to draw the plots as well.
    """
    photos, filmed, arm = read_photographs(), run_all(), RigidLinks(arm_config())
    sections: list[tuple[Table, list[Check]]] = [
        parameter_table(arm),
        theory_table(photos),
        average_table(photos),
        length_table(photos),
        golden_table(arm),
        (mode_table(), [*mode_checks(), inverse_check()]),
        skill_table(filmed),
        (sample_table(filmed), []),
        (printed_table(photos, arm), []),
    ]
    items: list[Table | Figure] = [table for table, _ in sections]
    if figures:
        from flexarm_bringup.reproduce.seed_004_figures import error_figure, move_figure, unit_figure

        items.insert(8, move_figure(filmed))
        items.insert(6, unit_figure(filmed.runs[SPRINGS].ramps))
        items.insert(4, error_figure(photos))
    remarks = {
        "Parameters": stiffness_lines(arm),
        "Fitted": FITTED,
        "Assumed": list(arm.config.assumed),
        "Errors and misprints of the paper": ERRATA,
        "Not claimed": NOT_CLAIMED,
    }
    checks = [check for _, found in sections for check in found]
    return Page(TITLE, LEAD, items, checks, remarks, {"stiffness_unit": "deg"})


def stiffness_lines(arm: RigidLinks) -> list[str]:
    """Return what stiffness and damping are, and where they come from."""
    k, c = (float(values[0]) for values in arm.springs)
    printed, ours = printed_values(), described_values(arm)
    is_paper = all(math.isclose(ours[x], printed[x], rel_tol=SAME) for x in printed if x[0] in "kc")
    whose = "paper's value" if is_paper else "not the paper's values, see table 2"
    return [
        f"stiffness_unit = deg: k = {math.radians(k):.2f} N m/deg = {k:.1f} N m/rad, c = {c:g} N m s/rad, "
        f"pressure {arm.config.parameters['pressure'] / 1e5:g} bar",
        f"k, c: {whose}, unit assumed; ramps and start times inferred",
    ]
