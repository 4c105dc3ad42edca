"""Compare a paper's published tables with what this model says about the same rig.

  flexarm reproduce 000                 the planar manipulator on three legs: frequencies at two poses
  flexarm reproduce 002                 the single-link arm: motions, frequencies, tip vibration
  flexarm reproduce 002 --html a.html   the same with plots
  flexarm reproduce 004                 the arm with variable-stiffness links: poses, matrices, filmed moves

The published numbers are the input; what is recomputed, fitted or assumed is said beside each.
The exit code is 1 when one of the bounds at the end is missed.
"""

from __future__ import annotations

import argparse
import importlib

from flexarm_bringup.report import add_report_arguments, publish

SEEDS = {  # each offers main(figures) -> Page
    "000": "flexarm_bringup.reproduce.seed_000",
    "001": "flexarm_bringup.reproduce.seed_001",
    "002": "flexarm_bringup.reproduce.seed_002",
    "004": "flexarm_bringup.reproduce.seed_004",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the number of the paper and the report files."""
    parser.add_argument("seed", choices=SEEDS, help="which paper, by its number in docs/references.md")
    add_report_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Print the comparison; return 1 when a bound is missed."""
    page = importlib.import_module(SEEDS[args.seed]).main(figures=args.html is not None)
    return publish(page, args)
