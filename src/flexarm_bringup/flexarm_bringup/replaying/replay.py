"""Feed a recorded bag through estimator and controller again, without DDS and without a clock.

  flexarm replay BAG                      is the bag whole, and what do the libraries make of it?
  flexarm replay BAG --output DIR         write their messages to a new bag; twice gives equal files
  flexarm replay BAG --against GOLDEN     compare every field with BAG itself, a replay of it, or another run
  flexarm replay BAG --remap /joint_states:=joint_states --remap /imu:=imu/tip_accelerometer
                                          a bag of another robot: what can the estimator not use of it?

A lockstep recording and its replay agree, but for the reason of a controller that waits because its margins
are too small: what it waits for is in no bag. A recording in real time holds what reached the recorder, in
that order, and the estimator may have seen another; compare its replays with each other. A recording may end
in the middle of an instant, a replay of the same run is compared to its last message.

The exit code is 1 when the first divergence has been named, 2 when a bag cannot be used.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from flexarm_bringup.arguments import refuse_idle
from flexarm_bringup.assumptions import resting_on
from flexarm_bringup.bags.bag_reader import Bag, check_bag
from flexarm_bringup.bags.configuration import configuration
from flexarm_bringup.bags.foreign_bag import Fed, feed_bag, read_remaps
from flexarm_bringup.bags.named_arm import NamedArm, add_arm_arguments, arm_named, chosen, open_bag
from flexarm_bringup.exit_codes import UNUSABLE
from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import Cells, Column, Page, Table, add_report_arguments, publish
from flexarm_bringup.replaying.compare import TOLERANCES, Comparison, compare_bags
from flexarm_bringup.replaying.replay_bag import NEEDED, OUTPUTS, is_replay, replay, written_for
from flexarm_bringup.replaying.two_runs import DRAWN, are_two_runs, how_they_end
from flexarm_bringup.tasks.node_settings import node_settings
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.settings.overrides import apply_overrides

SHOWN = 10  # divergences
FOREIGN = "single_link"  # whose estimator takes the bag of another robot, where none is named


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the bags and the report files."""
    parser.add_argument("bag", type=Path, help="folder of a recorded bag")
    parser.add_argument("--output", type=Path, metavar="DIR", help="keep the messages in a new bag")
    parser.add_argument("--against", type=Path, metavar="GOLDEN", help="compare them with those of this bag")
    parser.add_argument(
        "--remap",
        action="append",
        default=[],
        metavar="FROM:=TO",
        help="feed this topic of another robot's bag to the estimator alone; may be given several times",
    )
    add_arm_arguments(parser)
    add_report_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Replay, compare, report; return the exit code."""
    try:
        _refuse_idle(args)
        if args.remap:
            return publish(foreign_page(args), args)
        bag = open_bag(args.bag, NEEDED, arm_named(args))
        golden = check_bag(args.against, OUTPUTS[:1]) if args.against else None
        with _folder(args.output) as folder:
            replayed = replay(bag, folder)
    except ValueError as error:  # BagError; ConfigError or ParameterError of the configuration in the bag
        print(f"flexarm replay: {error}", file=sys.stderr)
        return UNUSABLE
    said = how_they_end(bag, golden) if golden and are_two_runs(bag, golden) else ""
    comparison = _compared(golden, replayed, bool(said)) if golden else None
    return publish(resting_on(page(bag, replayed, comparison, said), configuration(bag)[0]), args)


def _compared(golden: Bag, replayed: Bag, are_runs: bool) -> Comparison:
    """Compare the topics that nodes always say, and what else both bags have.

    Only a replay of the same run is compared to its last message: a recording may end in the middle.
    """
    more = {stream.name for stream in written_for(golden)} & {s.name for s in written_for(replayed)}
    topics = (*OUTPUTS, *sorted(more - set(OUTPUTS)))
    tolerances = (*DRAWN, *TOLERANCES) if are_runs else TOLERANCES
    free_end = are_runs or not is_replay(golden)
    return compare_bags(golden, replayed, topics, tolerances, free_end=free_end, are_runs=are_runs)


def _refuse_idle(args: argparse.Namespace) -> None:
    if args.remap:
        why = "not with --remap: a bag of another robot is fed to the estimator alone, and nothing written"
        refuse_idle(args, add_arguments, ("--output", "--against"), why)


def foreign_page(args: argparse.Namespace) -> Page:
    """Feed a bag of another robot to an arm with the settings of its moves; return what there is to say.

    Raises:
        BagError, ConfigError: The bag, a topic or the manipulator cannot be used.
    """
    bag, remaps = check_bag(args.bag), read_remaps(args.remap)
    task, preset = chosen(NamedArm(args.manipulator or FOREIGN, args.preset))
    config = load_config(find_manipulator(task.manipulator), preset)
    settings = apply_overrides(EstimatorConfig, node_settings(task, preset)["estimator"])
    fed = feed_bag(bag, remaps, config, settings)
    statuses = ", ".join(f"{count} {status}" for status, count in fed.statuses.items()) or "none"
    lead = f"Fed to the estimator of {config.name}. Estimates: {statuses}."
    data = {"ignored": fed.ignored, "estimates": fed.statuses}
    told = Page(f"Replay of {args.bag}", lead, _foreign_tables(fed, remaps), data=data)
    return resting_on(told, config)


def page(bag: Bag, replayed: Bag, comparison: Comparison | None, said: str = "") -> Page:
    """Return what there is to say about a replay; ``said``: of what it is compared with."""
    code, ours = bag.custom.get("git", "unknown code"), replayed.custom["git"]
    lead = f"{sum(bag.counts.values())} messages, recorded by {code}, replayed by {ours}.{said}"
    if not bag.has_checksum:
        lead += " The bag has no checksum of its data: changed bytes may pass unnoticed."
    columns = [Column("topic"), Column("recorded", "d"), Column("replayed", "d")]
    rows: list[Cells] = [[name, bag.counts.get(name, 0), replayed.counts[name]] for name in replayed.counts]
    items = [Table("Messages", columns, rows)]
    title = f"Replay of {bag.path}"
    if comparison is None:
        return Page(title, lead, items)
    first = str(comparison.divergences[0]) if comparison.divergences else "equal"
    compared = f"{sum(comparison.compared.values())} messages equal"
    unpaired = sum(replayed.counts.get(name, 0) - count for name, count in comparison.compared.items())
    if unpaired:
        lead += f" {unpaired} replayed messages have none to be compared with."
    checks = [Check("every field within its tolerance", compared, first, comparison.is_equal)]
    shown = comparison.divergences[:SHOWN]
    if shown:
        items.append(_divergence_table(comparison))
    data = {
        "divergent_messages": len(comparison.divergences),
        "divergences": [vars(item) for item in shown],
        "unpaired_messages": unpaired,
    }
    return Page(title, lead, items, checks, data=data)


def _divergence_table(comparison: Comparison) -> Table:
    shown = comparison.divergences[:SHOWN]
    rows: list[Cells] = [[f"{item.stamp_ns * 1e-9:.9f}", item.topic, item.field, item.text] for item in shown]
    rest = len(comparison.divergences) - len(shown)
    notes = [f"{rest} more messages differ"] if rest else []
    heads = [Column(title) for title in ("stamp [s]", "topic", "field", "found")]
    return Table("Divergences, first field of each message", heads, rows, notes)


def _foreign_tables(fed: Fed, remaps: Mapping[str, str]) -> list[Table]:
    messages: list[Cells] = [[name, count, remaps[name]] for name, count in fed.used.items()]
    messages += [[name, count, "-"] for name, count in sorted(fed.unused.items())]
    ignored: list[Cells] = [
        [source, reason, n] for source, reasons in fed.ignored.items() for reason, n in reasons.items()
    ]
    sensors: list[Cells] = [[r.name, r.accepted, r.rejected, r.status, r.reason] for r in fed.sensors]
    return [
        Table("Messages", [Column("topic"), Column("count", "d"), Column("fed as")], messages),
        Table("Ignored", [Column("sensor or topic"), Column("reason"), Column("count", "d")], ignored),
        Table(
            "Sensors at the end",
            [Column("sensor"), Column("fused", "d"), Column("refused", "d"), Column("status"), Column("why")],
            sensors,
        ),
    ]


@contextmanager
def _folder(output: Path | None) -> Iterator[Path]:
    """Give the folder asked for, or one that goes away afterwards."""
    if output:
        yield output
    else:
        with tempfile.TemporaryDirectory() as folder:
            yield Path(folder) / "replay"
