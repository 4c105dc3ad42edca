"""Recover a bag whose recorder was killed or ran out of disk: every whole message goes into a new bag.

  flexarm recover BAG --output DIR

BAG is a folder with one MCAP file, with or without metadata. What was recorded with and how is kept, so that
the new bag can be replayed. What was changed since then is said as far as checksums and the form of records
tell it. The exit code is 1 when something was left out or changed, and 2 when nothing can be recovered.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from flexarm_bringup.bags.bag_recovery import recover_bag
from flexarm_bringup.page.report import Cells, Column, Page, Table, add_report_arguments, publish

DOUBTFUL, UNUSABLE = 1, 2


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the bag and where to write."""
    parser.add_argument("bag", type=Path, help="folder of the broken bag")
    parser.add_argument("--output", type=Path, metavar="DIR", required=True, help="bag to create")
    add_report_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Recover, say how much; return the exit code."""
    try:
        recovery = recover_bag(args.bag, args.output)
    except (ValueError, OSError) as error:  # BagError
        print(f"flexarm recover: {error}", file=sys.stderr)
        return UNUSABLE
    bag = recovery.bag
    rows: list[Cells] = [[name, count] for name, count in bag.counts.items()]
    table = Table("Messages", [Column("topic"), Column("count", "d")], rows)
    lead = f"{sum(bag.counts.values())} messages recovered into {bag.path}."
    remarks: dict[str, Sequence[str]] = {"Doubts": recovery.doubts} if recovery.doubts else {}
    told = publish(Page(f"Recovery of {args.bag}", lead, [table], remarks=remarks), args)
    return max(told, DOUBTFUL if recovery.doubts else 0)
