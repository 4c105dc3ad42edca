"""Identify modes from measurements: frequency, damping and shape, with their uncertainty, no order to choose.

  flexarm identify FILE...                       responses or records; several files are set-ups of one test
  flexarm identify hammer.uff --band 5 500       only modes in that band [Hz]
  flexarm identify run.csv --resolution 0.5      records in time, lines 0.5 Hz apart, H1, coherence, bootstrap
  flexarm identify run.csv --manipulator single_link   beside the frequencies of the model
  flexarm identify run.csv --manipulator single_link --update my_arm.yaml --retune my_moves.yaml
      a fitted description, and settings of estimator and controller for it, tried on the simulated rig
  flexarm identify run.csv --manipulator single_link --fit bodies.strip.pieces.0.youngs_modulus
      --fit bodies.strip.damping_ratio=1 --update my_arm.yaml     (one line) only these parameters
  flexarm identify rig --manipulator single_link   check the sensors of the simulated rig, excite it through
      its guard, identify; --perturb frequency_scale=0.87 --perturb mass_scale=1.3 makes it another arm
  flexarm identify rig --manipulator single_link --nodes     the same over DDS: nodes, recorded into a bag
  flexarm identify BAG                           a recorded bag: torque as input, its sensors as outputs
  flexarm identify BAG --output-only             the same without any input: what the arm does by itself
  flexarm identify BAG --joints --manipulator NAME     friction, rotor inertia, gear stiffness from motion
  flexarm identify FILE --html report.html       responses, mode indicator, stabilisation chart, shapes

Files: universal files (.uff, .unv), .csv, MATLAB .mat, .npz, folders of bags. A table of responses has the
columns f_hz and OUTPUT/INPUT.re, OUTPUT/INPUT.im; records have t, in:NAME and out:NAME. Lines of low
coherence do not count.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.assumptions import resting_on
from flexarm_bringup.excite.measure import SensorCheckError
from flexarm_bringup.excite.page import check_table
from flexarm_bringup.exit_codes import UNUSABLE
from flexarm_bringup.identify.averaging import Averaging
from flexarm_bringup.identify.bag_source import refuse_bags_of_another_arm
from flexarm_bringup.identify.fittable import fittable
from flexarm_bringup.identify.fitted_file import refuse_unwritable
from flexarm_bringup.identify.halves import judge_halves, with_halves
from flexarm_bringup.identify.idle_options import refuse_averaging, refuse_idle_options
from flexarm_bringup.identify.joints import joints_page
from flexarm_bringup.identify.measurement import Records, SourceError, known_outputs
from flexarm_bringup.identify.modal_tests import modal_tests
from flexarm_bringup.identify.options import add_arguments
from flexarm_bringup.identify.other_poses import file_of, identify_there, other_poses, refuse_unusable
from flexarm_bringup.identify.output_only import output_only_page
from flexarm_bringup.identify.page import build_page
from flexarm_bringup.identify.retuning import moves_beside
from flexarm_bringup.identify.run import Request, identify
from flexarm_bringup.identify.runs_apart import compare_runs, run_tables
from flexarm_bringup.identify.sources import Source, of_records, read_records, read_sources
from flexarm_bringup.identify.updated_page import Updated, with_update
from flexarm_bringup.identify.updating import read_unknowns
from flexarm_bringup.page.report import Page, publish
from flexarm_bringup.progress import Progress
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

__all__ = ["add_arguments", "run"]

Array = NDArray[np.float64]


def run(args: argparse.Namespace) -> int:
    """Read, identify, report; return the exit code."""
    averaging, progress = Averaging(args.resolution, args.window or "", args.estimator), Progress()
    try:
        refuse_idle_options(args)
        if args.joints:
            page = joints_page(args, progress.say)
            progress.done()
            return publish(_told(page, args), args)
        _check(args)
        refuse_unusable(args.also, args.manipulator, args.preset)
        band, ignored = _band(args), args.ignore_channel
        tested, items = modal_tests(args)
        if args.output_only:
            records = tested or read_records(args.files, args.kind, _arm(args))
            page = output_only_page(args.files, records, band, ignored, items)
            return publish(_told(page, args), args)
        source = _source(args, tested, averaging)
        among = ignored if source.estimator else ()  # records are without them already
        request = Request(
            band, args.coherence, args.manipulator or "", args.preset, args.motors == "locked",
            known_outputs(source.responses.outputs, ignored, among), tuple(args.pose),
        )  # fmt: skip
        items += run_tables(compare_runs(source, request, averaging, progress.say))
        result = identify(source, request, progress.say)
        progress.done()
        others = [
            identify_there(there, args.kind, averaging, request, ignored) for there in other_poses(args.also)
        ]
        halves = judge_halves(source, request, averaging)
        page = with_halves(build_page(args.files, result, items), halves)
        updated = with_update(page, result, args, others, halves)
    except SensorCheckError as error:
        print(check_table(error.findings, error.axes).to_text())
        print(f"flexarm identify: {error}", file=sys.stderr)
        return UNUSABLE
    except (SourceError, ValueError, OSError) as error:
        print(f"flexarm identify: {error}", file=sys.stderr)
        return UNUSABLE
    return _ended(updated, args)


def _ended(updated: Updated, args: argparse.Namespace) -> int:
    """Publish the page; modes are told also where the update that was asked for is missing."""
    code = publish(_told(updated.page, args, updated.written), args)
    if updated.unmet:
        print(f"flexarm identify: {updated.unmet}", file=sys.stderr)
        return UNUSABLE
    return code


def _arm(args: argparse.Namespace) -> ManipulatorConfig | None:
    if not args.manipulator:
        return None
    return load_config(find_manipulator(args.manipulator), args.preset)


def _source(args: argparse.Namespace, tested: Sequence[Records], averaging: Averaging) -> Source:
    """Return the responses: of the modal test, or of the files."""
    if tested:
        return of_records(tested, averaging)
    source = read_sources(args.files, args.kind, averaging, args.ignore_channel, _arm(args))
    if not source.estimator:
        refuse_averaging(args)
    return source


def _told(page: Page, args: argparse.Namespace, written: Path | None = None) -> Page:
    """Return the page with what the description rests on: the ``written`` one, else that of the arm."""
    if not args.manipulator:
        return page  # what was measured is held against nothing
    return resting_on(page, load_config(written or find_manipulator(args.manipulator), args.preset))


def _band(args: argparse.Namespace) -> tuple[float, float] | None:
    if not args.band:
        return None
    low, high = args.band
    if low >= high:
        raise ValueError(f"--band {low:g} {high:g}: expected LOW below HIGH")
    return float(low), float(high)


def _check(args: argparse.Namespace) -> None:
    wants_fit = bool(args.fit or args.update is not None or args.also)
    if wants_fit and not args.manipulator:
        raise ValueError("--fit, --update and --also need --manipulator NAME: what is to be fitted?")
    _check_arm(args)
    if args.retune is not None and args.update is None:
        raise ValueError("--retune needs --update: settings are chosen for the new description")
    if wants_fit and not args.fit:
        args.fit = list(fittable(find_manipulator(args.manipulator), args.preset))
        if not args.fit:
            raise ValueError(
                f"--update: name what to fit with --fit PATH; nothing in {args.manipulator} suggests itself: "
                "no modulus, point mass, damping ratio, spring or damper above 0"
            )
    if wants_fit:
        _check_fit(args)
    if args.update == Path():
        args.update = Path(f"{Path(args.manipulator).stem}_fitted.yaml")
    if args.retune == Path():
        args.retune = moves_beside(args.update)


def _check_fit(args: argparse.Namespace) -> None:
    """Tell before the test what cannot be fitted, or not be written."""
    unknowns = read_unknowns(args.manipulator, args.preset, args.fit)
    if args.update is not None:
        refuse_unwritable(args.manipulator, args.preset, unknowns)


def _check_arm(args: argparse.Namespace) -> None:
    arm = _arm(args)
    if arm is not None:
        refuse_bags_of_another_arm([*args.files, *map(file_of, args.also)], arm)
    elif args.pose:
        raise ValueError("--pose needs --manipulator NAME: its model at the pose is what is held beside")
