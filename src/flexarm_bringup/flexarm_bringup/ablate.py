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
from flexarm_bringup.consistency.ablation import NONE, Ablation, Without, judge_tracks, run_ablation
from flexarm_bringup.consistency.recording import open_recording
from flexarm_bringup.consistency.smoothing import NO_TRUTH, truth_for
from flexarm_bringup.exit_codes import UNUSABLE
from flexarm_bringup.page.figures import Figure, drawing, to_figure
from flexarm_bringup.page.report import Cells, Column, Page, Table, add_report_arguments, publish
from flexarm_bringup.parallel import run_parallel
from flexarm_bringup.progress import Progress

Array = NDArray[np.float64]
MICRO = 1e6
TOO_MUCH = (
    "below 1: this record is estimated better without it; its noise is told too low, or what the model is "
    "doubted for (sag_error, stiffness_error, modal_force) too high"
)


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
    heads += [Column("told sigma\n[um]", ".1f"), Column("usable\n[%]", ".1f")]
    base = results[0].tip
    rows: list[Cells] = [
        [
            result.sensor, MICRO * result.tip, result.tip / base if base else None,
            MICRO * result.tip_sigma, 100 * result.usable,
        ]
        for result in results
    ]  # fmt: skip
    return Table("Tip", heads, rows, [TOO_MUCH])


def mode_tables(results: Sequence[Without]) -> list[Table]:
    """Return the tables of the modes' errors and sigmas, as motion of the tip."""
    count = results[0].modes.size
    heads = [Column("left out"), *(Column(f"mode {k + 1}", ".2f") for k in range(count))]
    off: list[Cells] = [[result.sensor, *(MICRO * result.modes).tolist()] for result in results[1:]]
    told: list[Cells] = [[result.sensor, *(MICRO * result.mode_sigmas).tolist()] for result in results]
    notes = ["what the mode does at the tip; against the estimate of all sensors"]
    return [
        Table("Modes: difference [um RMS]", heads, off, notes),
        Table("Modes: told sigma [um RMS]", heads, told),
    ]


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
