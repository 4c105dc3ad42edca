"""Options of ``flexarm identify`` that would change nothing are refused with what they go with."""

from __future__ import annotations

import argparse
from pathlib import Path

from flexarm_bringup.arguments import refuse_idle
from flexarm_bringup.excite.rig_source import RIG
from flexarm_bringup.identify.measurement import SourceError
from flexarm_bringup.identify.options import add_arguments
from flexarm_bringup.identify.other_poses import file_of
from flexarm_bringup.identify.table_source import READERS

OF_RIG = ("--excite", "--share", "--periods", "--perturb", "--faults", "--nodes", "--bag")
OF_RECORDS = ("--resolution", "--window", "--estimator")
OF_INPUTS = ("--coherence", "--window", "--estimator", "--kind", "--motors")  # --output-only has none
OF_FIT = ("--fit", "--also", "--update", "--retune")
OF_MODES = (
    *OF_RECORDS,
    *OF_INPUTS,
    *OF_FIT,
    "--band",
    "--output-only",
    "--ignore-channel",
    "--pose",
    "--save",
)


def refuse_idle_options(args: argparse.Namespace) -> None:
    """Refuse what would be ignored, whatever the files hold.

    Raises:
        ValueError: Names the options, and what they go with.
    """
    is_rig = args.files == [Path(RIG)]
    if args.joints:
        others = [option for option in (*OF_MODES, *OF_RIG) if option != "--perturb"]
        refuse_idle(args, add_arguments, dict.fromkeys(others), "not with --joints, which looks at no modes")
        if len(args.files) > 1:
            raise SourceError(f"--joints takes one source, not {len(args.files)}")
    if args.output_only:
        why = "not with --output-only: no input is known, and nothing fitted"
        refuse_idle(args, add_arguments, (*OF_INPUTS, *OF_FIT), why)
    if args.output_only and not is_rig:
        refuse_idle(args, add_arguments, ("--resolution", "--pose"), "with --output-only it goes with rig")
    if not is_rig:
        refuse_idle(args, add_arguments, OF_RIG, f"goes with {RIG} as the source")
    _refuse_kind(args)
    if not args.nodes:
        refuse_idle(args, add_arguments, ("--bag",), "goes with --nodes")
    if not args.manipulator:
        refuse_idle(args, add_arguments, ("--preset", "--motors"), "goes with --manipulator NAME")


def _refuse_kind(args: argparse.Namespace) -> None:
    """Refuse --kind where no file is a table."""
    if not any(path.suffix.lower() in READERS for path in (*args.files, *map(file_of, args.also))):
        why = (
            f"is for the outputs of tables ({', '.join(READERS)}); universal files, bags and {RIG} say theirs"
        )
        refuse_idle(args, add_arguments, ("--kind",), why)


def refuse_averaging(args: argparse.Namespace) -> None:
    """Refuse what makes responses of records, where the files hold responses.

    Raises:
        ValueError: Names the options.
    """
    if not args.also:  # whose files may be records
        refuse_idle(args, add_arguments, OF_RECORDS, "goes with records in time; the files hold responses")
