"""Estimate a bag once more, looking back: every state given also what was sampled up to a lag later.

  flexarm smooth BAG                      how much better is the past known, at the tip and per mode?
  flexarm smooth BAG --csv states.csv     write tip and modes of every instant
  flexarm smooth BAG --lag 1.0 --html report.html
  flexarm smooth BAG --loss huber         outliers that the gate lets pass count less

For what is looked at after a run: identification, a report, a test of the estimator on a rig that has no
truth of its own. The tip's error is against the truth where the bag has it (the simulated rig records it).
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from contextlib import nullcontext, redirect_stdout
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.arguments import STDOUT, number, output_file
from flexarm_bringup.assumptions import resting_on
from flexarm_bringup.bags.named_arm import add_arm_arguments, arm_named
from flexarm_bringup.consistency.ablation import NONE, Track, refuse_unsettled, track_of
from flexarm_bringup.consistency.recording import open_recording, run_estimator
from flexarm_bringup.consistency.settled import SETTLING
from flexarm_bringup.consistency.smoothing import NO_TRUTH, Late, run_smoother, tip_error, truth_for
from flexarm_bringup.exit_codes import UNUSABLE
from flexarm_bringup.page.figures import Figure, drawing, to_figure
from flexarm_bringup.page.report import Cells, Column, Page, Table, add_report_arguments, publish
from flexarm_bringup.progress import Progress
from flexarm_estimator.robust.losses import LOSSES

Array = NDArray[np.float64]
LAG, LONGEST = 0.3, 1.8  # s; an estimator keeps two seconds of its past
MICRO = 1e6


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the bag, the lag and the files."""
    parser.add_argument("bag", type=Path, help="folder of a recorded bag")
    add_arm_arguments(parser)
    parser.add_argument(
        "--lag",
        type=number(above=0.0, at_most=LONGEST),
        default=LAG,
        metavar="S",
        help=f"how far later counts (default: {LAG} s)",
    )
    parser.add_argument(
        "--loss",
        choices=("square", *LOSSES),
        help="what a sample costs that is off; found over the lag (default: as in the bag)",
    )
    parser.add_argument(
        "--csv", type=output_file, metavar="FILE",
        help="write tip and modes of every instant; -: to stdout, and the report to stderr",
    )  # fmt: skip
    add_report_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Filter, smooth, report; return the exit code."""
    progress = Progress()
    try:
        if args.csv == STDOUT and STDOUT in (args.json, args.html):
            raise ValueError("--csv -: has the standard output for itself, without --json - and --html -")
        progress.say("reading the bag")
        recording = open_recording(args.bag, arm_named(args))
        progress.say("filtering")
        now = track_of(NONE, run_estimator(recording, tell=progress.counted("filtering", "s")))
        refuse_unsettled([now], args.bag)
        progress.say("smoothing")
        late = run_smoother(recording, args.lag, args.loss, progress.counted("smoothing", "s"))
    except ValueError as error:  # BagError; ConfigError or ParameterError of the configuration in the bag
        progress.done()
        print(f"flexarm smooth: {error}", file=sys.stderr)
        return UNUSABLE
    late = judged_with(late, now.stamps_ns)
    if args.csv:
        write_csv(args.csv, late)
    truth = truth_for(now.stamps_ns, recording.true_tip())
    figures = [draw(now, late, truth)] if args.html else []
    progress.done()
    page = resting_on(build_page(args, now, late, truth, figures), recording.config)
    with redirect_stdout(sys.stderr if args.csv == STDOUT else sys.stdout):
        return publish(page, args)


def judged_with(late: Late, stamps_ns: Sequence[int]) -> Late:
    """Return what is told of these stamps [ns], at which the filter is judged."""
    kept = np.isin(late.stamps_ns, np.array(stamps_ns))
    return Late(*(column[kept] for column in late))


def write_csv(path: Path, late: Late) -> None:
    """Write one line per instant, with names and units in the first one; "-" is the standard output."""
    modes = range(1, late.eta.shape[1] + 1)
    names = ["stamp [ns]", "x [m]", "y [m]", "z [m]", "sigma [m]"]
    names += [f"mode {k} [kg^0.5 m]" for k in modes] + [f"rate of mode {k} [kg^0.5 m/s]" for k in modes]
    numbers = np.column_stack([late.tip, late.tip_sigma, late.eta, late.eta_dot])
    with nullcontext(sys.stdout) if path == STDOUT else path.open("w", encoding="utf8") as file:
        print(",".join(names), file=file)
        for stamp_ns, row in zip(late.stamps_ns, numbers, strict=True):
            print(stamp_ns, *(f"{value:.9g}" for value in row), sep=",", file=file)


def build_page(
    args: argparse.Namespace, now: Track, late: Late, truth: Mapping[int, Array], figures: list[Figure]
) -> Page:
    """Return what there is to say about a bag."""
    looked = f"smoother, {args.lag:g} s later" + (f", loss {args.loss}" if args.loss else "")
    rows: list[Cells] = [
        [name, _micro(tip_error(at, tip, truth)), MICRO * float(np.sqrt(np.mean(sigma**2))), len(at)]
        for name, at, tip, sigma in (
            ("filter, as it was told then", now.stamps_ns, now.tip, now.tip_sigma),
            (looked, late.stamps_ns.tolist(), late.tip, late.tip_sigma),
        )
    ]
    heads = [Column("estimate"), Column("tip error\n[um RMS]", ".1f"), Column("told sigma\n[um RMS]", ".1f")]
    heads.append(Column("instants", "d"))
    notes = [] if truth else [NO_TRUTH]
    lead = (
        f"Every state given also what was sampled up to {args.lag:g} s later; {SETTLING:g} s are left out "
        "from every time on that the filter began."
    )
    return Page(f"{args.bag}, looked back at", lead, [Table("Tip", heads, rows, notes), *figures])


def draw(now: Track, late: Late, truth: Mapping[int, Array]) -> Figure:
    """Return the tip's error over time, or, without a truth, what looking back changed."""
    known = truth or dict(zip(late.stamps_ns.tolist(), late.tip, strict=True))
    runs = {"filter": (now.stamps_ns, now.tip)}
    if truth:
        runs["smoother"] = (late.stamps_ns.tolist(), late.tip)
    with drawing(9.0, 3.5) as plot:
        axes = plot.subplots()
        for name, (stamps, tip) in runs.items():
            pairs = [(s, row - known[s]) for s, row in zip(stamps, tip, strict=True) if s in known]
            t = np.array([s - now.stamps_ns[0] for s, _ in pairs]) * 1e-9
            axes.semilogy(
                t, MICRO * np.linalg.norm([row for _, row in pairs], axis=1), label=name, linewidth=0.8
            )
        axes.set(xlabel="time [s]", ylabel="tip error [um]" if truth else "filter - smoother [um]")
        axes.legend()
        return to_figure(
            plot, "Distance of the tip from the truth." if truth else "What looking back changed."
        )


def _micro(value: float) -> float | None:
    return None if np.isnan(value) else MICRO * value
