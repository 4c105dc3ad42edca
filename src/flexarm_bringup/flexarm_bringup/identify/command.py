"""Identify modes from measurements: frequency, damping and shape, with their uncertainty, no order to choose.

  flexarm identify FILE...                       responses or records; several files are set-ups of one test
  flexarm identify hammer.uff --band 5 500       only modes in that band [Hz]
  flexarm identify run.csv --resolution 0.5      records in time, lines 0.5 Hz apart, H1, coherence, bootstrap
  flexarm identify run.csv --manipulator single_link   beside the frequencies of the model
  flexarm identify FILE --html report.html       responses, mode indicator, stabilisation chart, shapes

Files: universal files (.uff, .unv), .csv, MATLAB .mat, .npz. A table of responses has the columns f_hz and
OUTPUT/INPUT.re, OUTPUT/INPUT.im; records have t, in:NAME and out:NAME. Lines of low coherence do not count.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from flexarm_bringup.identify.measurement import SourceError
from flexarm_bringup.identify.page import build_page
from flexarm_bringup.identify.run import Request, identify
from flexarm_bringup.identify.sources import Averaging, read_sources
from flexarm_bringup.report import add_report_arguments, publish
from flexarm_model.identification.spectra import ESTIMATORS
from flexarm_model.modal.frf import KINDS

UNUSABLE = 2


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help="measurements")
    parser.add_argument("--band", nargs=2, type=float, metavar=("LOW", "HIGH"), help="only these [Hz]")
    parser.add_argument(
        "--kind", default="accelerance", choices=sorted(KINDS), help="of outputs of a table; accelerance"
    )
    parser.add_argument("--resolution", type=float, metavar="HZ", help="distance of the lines, for records")
    parser.add_argument("--window", default="hann", help="for records; boxcar for impacts that have died out")
    parser.add_argument("--estimator", default="H1", choices=ESTIMATORS, help="for records")
    parser.add_argument(
        "--coherence", type=float, default=0.6, metavar="LEAST", help="lines below it do not count; 0.6"
    )
    parser.add_argument("--manipulator", metavar="NAME", help="print its served frequencies beside")
    parser.add_argument("--preset", default="", help="preset of that manipulator")
    add_report_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Read, identify, report; return the exit code."""
    averaging = Averaging(args.resolution, args.window, args.estimator)
    request = Request(
        tuple(args.band) if args.band else None, args.coherence, args.manipulator or "", args.preset
    )
    try:
        source = read_sources(args.files, args.kind, averaging)
        result = identify(source, request, args.estimator)
    except (SourceError, ValueError) as error:
        print(f"flexarm identify: {error}", file=sys.stderr)
        return UNUSABLE
    return publish(build_page(args.files, result), args)
