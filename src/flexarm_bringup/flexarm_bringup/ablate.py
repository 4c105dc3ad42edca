"""Estimate a bag again without each sensor in turn, and tell what the sensor buys.

  flexarm ablate BAG                      tip error and modes without every sensor
  flexarm ablate BAG --html report.html   the same with bars

The tip's error is against the truth where the bag has it (the simulated rig records it), else against the
estimate of all sensors; that of the modes is always against the estimate of all sensors.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.assumptions import resting_on
from flexarm_bringup.bags.named_arm import add_arm_arguments, arm_named
from flexarm_bringup.consistency.ablation import NONE, Ablation, refuse_unsettled, run_ablation
from flexarm_bringup.consistency.recording import open_recording
from flexarm_bringup.consistency.smoothing import NO_TRUTH, truth_for
from flexarm_bringup.consistency.worth import Without, judge_tracks
from flexarm_bringup.exit_codes import UNUSABLE
from flexarm_bringup.page.figures import Figure, drawing, to_figure
from flexarm_bringup.page.report import Cells, Column, Page, Table, add_report_arguments, publish
from flexarm_bringup.parallel import run_parallel
from flexarm_bringup.progress import Progress

Array = NDArray[np.float64]
MICRO = 1e6
NOTES = (
    "errors and sigmas are those of instants at which the estimate may be used",
    "in use: share of these at which the sensor was, with none left out: neither silent, off nor faulty; "
    "two are compared where both may be used and it was",
)
TOO_MUCH = (
    "this record is estimated better without it, by more than errors scatter from one tenth of the record to "
    "the next; its noise is told too low, or what the model is doubted for (process noise, sag_error, "
    "stiffness_error) too high"
)
NEVER = "it was never in use in this record: nothing tells what it buys"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the bag and the report files."""
    parser.add_argument("bag", type=Path, help="folder of a recorded bag")
    add_arm_arguments(parser)
    add_report_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Estimate, compare, report; return the exit code."""
    progress = Progress()
    try:
        progress.say("reading the bag")
        recording = open_recording(args.bag, arm_named(args))
        names = [NONE, *(spec.name for spec in recording.config.sensors)]
        tracks = run_parallel(
            run_ablation,
            [Ablation(args.bag, name, arm_named(args)) for name in names],
            progress.counted("estimating", "runs"),
        )
        refuse_unsettled(tracks[:1], args.bag)
    except ValueError as error:  # BagError; ConfigError or ParameterError of the configuration in the bag
        progress.done()
        print(f"flexarm ablate: {error}", file=sys.stderr)
        return UNUSABLE
    stamps_ns = [stamp for track in tracks for stamp in track.stamps_ns]
    truth = truth_for(stamps_ns, recording.true_tip())
    results = judge_tracks(tracks, truth)
    figures = [draw(results, truth)] if args.html else []
    progress.done()
    return publish(resting_on(build_page(args.bag, results, truth, figures), recording.config), args)


def build_page(
    path: Path, results: Sequence[Without], truth: Mapping[int, Array], figures: Sequence[Figure] = ()
) -> Page:
    """Return what there is to say about a bag."""
    against = "the truth that the bag has" if truth else f"the estimate of all sensors: {NO_TRUTH}"
    lead = f"Every sensor left out in turn; tip error against {against}."
    return Page(
        f"What the sensors of {path} buy", lead, [tip_table(results), *mode_tables(results), *figures]
    )


def tip_table(results: Sequence[Without]) -> Table:
    """Return the table of the tip's errors."""
    heads = [Column("left out"), Column("tip error\n[um RMS]", ".1f"), Column("times that\nof all", ".2f")]
    heads += [Column("told sigma\n[um]", ".1f"), Column("usable\n[%]", ".1f"), Column("in use\n[%]", ".1f")]
    rows: list[Cells] = [
        [
            result.sensor,
            *_known([MICRO * result.tip, result.ratio, MICRO * result.tip_sigma]),
            *_known([100 * result.usable, 100 * result.in_use]),
        ]
        for result in results
    ]
    better = [f"{result.sensor}: {TOO_MUCH}" for result in results if result.is_better]
    never = [f"{result.sensor}: {NEVER}" for result in results if result.in_use == 0.0]
    return Table("Tip", heads, rows, [*NOTES, *better, *never])


def mode_tables(results: Sequence[Without]) -> list[Table]:
    """Return the tables of the modes' errors and sigmas, as motion of the tip."""
    count = results[0].modes.size
    heads = [Column("left out"), *(Column(f"mode {k + 1}", ".2f") for k in range(count))]
    off: list[Cells] = [[result.sensor, *_known(MICRO * result.modes)] for result in results[1:]]
    told: list[Cells] = [[result.sensor, *_known(MICRO * result.mode_sigmas)] for result in results]
    notes = ["what the mode does at the tip; against the estimate of all sensors"]
    return [
        Table("Modes: difference [um RMS]", heads, off, notes),
        Table("Modes: told sigma [um RMS]", heads, told),
    ]


def _known(values: Sequence[float] | Array) -> list[float | None]:
    """Return numbers for cells, empty where nothing tells them."""
    return [None if np.isnan(value) else float(value) for value in values]


def draw(results: Sequence[Without], truth: Mapping[int, Array]) -> Figure:
    """Return the bars of the tip's errors beside what the estimates say of them."""
    with drawing(9.0, 1.2 + 0.35 * len(results)) as plot:
        axes = plot.subplots()
        places = np.arange(len(results))
        axes.barh(places - 0.2, [MICRO * result.tip for result in results], 0.4, label="error")
        axes.barh(places + 0.2, [MICRO * result.tip_sigma for result in results], 0.4, label="told sigma")
        axes.set(yticks=places, yticklabels=[result.sensor for result in results])
        axes.set(xlabel="tip [um RMS]", xscale="log")
        axes.invert_yaxis()
        axes.legend()
        against = "the truth" if truth else "the estimate of all sensors"
        return to_figure(plot, f"Error of the tip against {against}, without each sensor.")
