"""Compare a paper's published tables with what this model says about the same rig.

  flexarm reproduce 000                 the planar manipulator on three legs: frequencies at two poses
  flexarm reproduce 001                 the spatial manipulator on three legs: modes, damping, stiffness
  flexarm reproduce 002                 the single-link arm: motions, frequencies, tip vibration
  flexarm reproduce 003                 the six-axis robot: frequency responses of full and reduced models
  flexarm reproduce 004                 the arm with variable-stiffness links: poses, matrices, filmed moves
  flexarm reproduce 002 --html a.html   the same with plots
  flexarm reproduce all --html a.html   all of them, as a-000.html, a-001.html, ...
  flexarm reproduce all --json -        all of them in one object, by number

The published numbers are the input; what is recomputed, fitted or assumed is said beside each.
The exit code is 1 when one of the bounds at the end is missed.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import json
import sys
from pathlib import Path

from flexarm_bringup.arguments import STDOUT, output_file
from flexarm_bringup.exit_codes import UNUSABLE
from flexarm_bringup.page.report import Cell, Column, Page, Table, add_report_arguments, publish
from flexarm_bringup.parallel import cores, worker_pool
from flexarm_bringup.progress import Progress

SEEDS = {  # each offers main(figures) -> Page
    "000": "flexarm_bringup.reproduce.seed_000",
    "001": "flexarm_bringup.reproduce.seed_001",
    "002": "flexarm_bringup.reproduce.seed_002",
    "003": "flexarm_bringup.reproduce.seed_003",
    "004": "flexarm_bringup.reproduce.seed_004",
}
ALL = "all"
SLOWEST_FIRST = ("003", "001", "002", "004", "000")  # so that no core waits long at the end


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the number of the paper and the report files."""
    parser.add_argument(
        "seed",
        choices=(*SEEDS, ALL),
        metavar="PAPER",
        help=f"which paper, by its number in docs/references.md: {', '.join(SEEDS)}; or {ALL}",
    )
    add_report_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Print the comparison; return 1 when a bound is missed."""
    figures = args.html is not None
    if args.seed != ALL:
        return publish(compare(args.seed, figures), args)
    try:
        files = own_files(args)  # refused before anything is computed
    except argparse.ArgumentTypeError as error:
        print(f"flexarm reproduce {ALL}: {error}", file=sys.stderr)
        return UNUSABLE
    pages = compare_all(figures)
    if args.json == STDOUT:
        print(json.dumps({seed: page.to_json() for seed, page in pages.items()}, indent=1, allow_nan=False))
    aside = sys.stderr if args.json == STDOUT else sys.stdout
    with contextlib.redirect_stdout(aside):
        code = max(publish(page, files[seed]) for seed, page in pages.items())
    print(_summary(pages).to_text(), file=aside)
    return code


def compare(seed: str, figures: bool) -> Page:
    """Return the page of one paper."""
    page: Page = importlib.import_module(SEEDS[seed]).main(figures=figures)
    return page


def compare_all(figures: bool) -> dict[str, Page]:
    """Return the pages of all papers, made on all cores."""
    progress = Progress()
    with worker_pool(cores()) as pool:
        futures = {seed: pool.submit(compare, seed, figures) for seed in SLOWEST_FIRST}
        pages: dict[str, Page] = {}
        for seed in SEEDS:
            progress.say(f"comparing: {len(pages)} of {len(SEEDS)} papers, waiting for {seed}")
            pages[seed] = futures[seed].result()
    progress.done()
    return pages


def _summary(pages: dict[str, Page]) -> Table:
    rows: list[list[Cell]] = [
        [seed, page.title, sum(check.passed for check in page.checks), len(page.checks)]
        for seed, page in pages.items()
    ]
    columns = [Column("seed"), Column("paper"), Column("bounds met", "d"), Column("of", "d")]
    return Table("All papers", columns, rows)


def own_files(args: argparse.Namespace) -> dict[str, argparse.Namespace]:
    """Return by paper where its page is written; JSON for the standard output is one object of all, not here.

    Raises:
        argparse.ArgumentTypeError: A file cannot be written, or all pages would go to the standard output.
    """
    if args.html == STDOUT:
        raise argparse.ArgumentTypeError(
            f"--html {STDOUT}: expected the name of a file, which every paper gets with its own number"
        )
    json_file = None if args.json == STDOUT else args.json
    return {
        seed: argparse.Namespace(json=_own(json_file, seed), html=_own(args.html, seed)) for seed in SEEDS
    }


def _own(path: Path | None, seed: str) -> Path | None:
    return path and output_file(str(path.with_name(f"{path.stem}-{seed}{path.suffix}")))
