"""Modal tests as sources: the simulated rig in one process or as nodes, and bags of what a node excited."""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from flexarm_bringup.excite.bag import read_test
from flexarm_bringup.excite.measure import MeasuredTest
from flexarm_bringup.excite.page import check_table, plan_table
from flexarm_bringup.excite.rig_source import RIG, RigTest, rig_test, run_rig_test, save_records
from flexarm_bringup.identify.measurement import Records, SourceError
from flexarm_bringup.page.report import Table
from flexarm_bringup.progress import Progress


def modal_tests(args: argparse.Namespace) -> tuple[tuple[Records, ...], list[Table]]:
    """Return the records of the test that is asked for or recorded, and how they were measured.

    Nothing where the files are none. Records that are kept become the files.

    Raises:
        SourceError: The test could not be done, or a channel cannot be used.
    """
    tests = (_of_rig(args),) if args.files == [Path(RIG)] else _of_bags(args.files)
    records = tuple(run for tested in tests for run in tested.records)
    if args.save is not None and not tests:
        raise SourceError(f"--save: goes with {RIG}, or with bags of a modal test")
    if args.save is not None:
        args.files = list(save_records(records, args.save))
    return records, [
        table for tested in tests for table in (plan_table(tested), check_table(tested.findings, tested.axes))
    ]


def _of_rig(args: argparse.Namespace) -> MeasuredTest:
    """Excite the simulated rig."""
    progress = Progress()
    if args.save is None and args.update is not None:
        args.save = args.update.with_name(f"{args.update.stem}_rig.npz")
    try:
        test = rig_test(args)
        return _over_dds(args, test, progress.say) if args.nodes else run_rig_test(test, progress.say)
    finally:
        progress.done()


def _over_dds(args: argparse.Namespace, test: RigTest, say: Callable[[str], None]) -> MeasuredTest:
    """Excite it as nodes, and keep bag and log files where that is wanted."""
    from flexarm_bringup.excite.live_source import run_live_test

    if args.bag is None:
        with tempfile.TemporaryDirectory(prefix="flexarm_excite_") as folder:
            return run_live_test(test, args.nodes, Path(folder), say)
    if args.bag.exists():
        raise SourceError(f"--bag {args.bag}: exists already")
    return run_live_test(test, args.nodes, args.bag, say)


def _of_bags(files: list[Path]) -> tuple[MeasuredTest, ...]:
    """Return what was excited in bags; nothing unless all files are such bags."""
    found = [read_test(path) if (path / "metadata.yaml").is_file() else None for path in files]
    tests = tuple(
        _named(path, tested) for path, tested in zip(files, found, strict=True) if tested is not None
    )
    return tests if len(tests) == len(files) else ()


def _named(path: Path, tested: MeasuredTest) -> MeasuredTest:
    """Return a test whose records say from which bag they come."""
    return replace(tested, records=tuple(replace(run, file=path.name) for run in tested.records))
