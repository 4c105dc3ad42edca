"""Seed 003, the six-axis robot with flexible bodies: models of falling order on an assumed set of numbers.

Order of reading: all that is assumed, what the robot is (order, frequencies, statics, responses), where
reductions part, the served form, the paper's deviations beside those from synthetic robots, which statements
can be checked.
"""

from __future__ import annotations

from flexarm_bringup.page.check import Check
from flexarm_bringup.page.figures import Figure
from flexarm_bringup.page.report import Page, Table
from flexarm_bringup.reproduce.seed_003_assumed import assumed_here
from flexarm_bringup.reproduce.seed_003_comparison import paper_table, robot_table
from flexarm_bringup.reproduce.seed_003_golden import (
    frequency_table,
    kinematics_checks,
    order_table,
    response_table,
)
from flexarm_bringup.reproduce.seed_003_links import link_table
from flexarm_bringup.reproduce.seed_003_orders import deviation_table, reduction_table
from flexarm_bringup.reproduce.seed_003_path import path_section
from flexarm_bringup.reproduce.seed_003_served import served_table
from flexarm_bringup.reproduce.seed_003_statements import statement_table
from flexarm_bringup.reproduce.seed_003_statics import static_table

TITLE = "Seed 003, the six-axis robot with flexible bodies: models of falling order on assumed numbers"
LEAD = (
    "The paper compares models of a measured robot and prints none of its data. Here a plausible robot of no "
    "make stands in for it, so that what the models say of each other can be checked, and nothing else."
)
FITTED = (
    "18 rotational stiffnesses of the lumped model, on the responses of a synthetic robot at mid; of several "
    "starts the fit that leaves least"
)
SECTIONS = (  # each returns a table and its checks
    order_table,
    link_table,
    frequency_table,
    static_table,
    response_table,
    deviation_table,
    reduction_table,
    served_table,
    paper_table,
    robot_table,
    statement_table,
)
REMARKS = {
    "Points of the paper a reader must know": (
        "Accuracy is defined as the tool's largest distance; the 52 and 53 % compare averages, none in mm.",
        "The flexible model beats the lumped one in responses (4.5 against 5.5 dB) and loses on the path.",
        "The lumped model is fitted to measured responses, the flexible one comes from datasheets.",
        "Whether the pose compared was among those fitted is not said.",
        "Nothing was measured above 100 Hz, where the reductions differ.",
    ),
    "Not established": (
        "every physical parameter of the robot, its poses, controller, path and coupling ratios",
        "the number of degrees of freedom of the flexible model; what the averages over frequency mean",
    ),
    "Not claimed": (
        "reproduction of 9.8, 5.5 or 4.5 dB or of +52 %; agreement with any figure",
        "that the parameters are those of a product",
        "that the limits of the reductions, 100 and 300 Hz, are predicted",
        "that a lumped model which is fitted at one pose is the worse one at others",
    ),
}


def main(figures: bool = False) -> Page:
    """Compute everything and return it as a page.

    Args:
        figures: Whether to draw the plots as well.
    """
    sections: list[tuple[Table, list[Check]]] = [section() for section in SECTIONS]
    path_tables, path_checks = path_section()
    items: list[Table | Figure] = [*(table for table, _ in sections), *path_tables]
    if figures:
        from flexarm_bringup.reproduce.seed_003_figures import all_figures
        from flexarm_bringup.reproduce.seed_003_path_figure import path_figure

        items += [*all_figures(), path_figure()]
    remarks = {"Fitted": [FITTED], **REMARKS}
    checks = [*kinematics_checks(), *(check for _, found in sections for check in found), *path_checks]
    return Page(TITLE, LEAD, items, checks, remarks, premises={"Assumed": assumed_here()})
