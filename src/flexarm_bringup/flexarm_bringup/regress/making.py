"""Cases made and renewed: a bag is copied, played, and what came of it becomes what is expected."""

from __future__ import annotations

import os
import shutil
import stat
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from flexarm_bringup.bags.bag_copy import copy_bag
from flexarm_bringup.bags.bag_reader import Bag, check_bag
from flexarm_bringup.bags.bag_writer import BagError, BagWriter, refuse_inside
from flexarm_bringup.bags.cdr import NS_PER_S
from flexarm_bringup.regress.case import BAG, GOLDEN, Case, read_case, write_case
from flexarm_bringup.regress.drift import Moved, find_moved
from flexarm_bringup.regress.judge import compare, open_case
from flexarm_bringup.regress.named_arm import name_from
from flexarm_bringup.regress.pinned import Pinned, pin
from flexarm_bringup.regress.playing import MODEL, Played, configured, play
from flexarm_bringup.regress.replacing import finish_replacing, replace_golden
from flexarm_bringup.regress.settings_check import check_settings
from flexarm_bringup.regress.tolerance_check import check_tolerances
from flexarm_bringup.replaying.compare import TOLERANCES, Divergence
from flexarm_bringup.replaying.replay_bag import NEEDED, configuration
from flexarm_bringup.tick_check import check_ticks
from flexarm_bringup.topics import find_stream

WALL_CLOCK = ("/diagnostics",)  # its messages hold times of day and of the processor


@dataclass(frozen=True)
class Source:
    """What a case is made of.

    Attributes:
        bag: Folder of any bag that can be replayed.
        about: What it is, for the reader.
        manipulator: Name or file, by its path from the working directory; empty: what the bag says.
        preset, settings: See ``Case``; empty: what the bag says.
        until: Only messages logged before this time after the first are kept [s]; infinite: all.
        markers: Marks that pytest gives the case.
    """

    bag: Path
    about: str = ""
    manipulator: str = ""
    preset: str = ""
    settings: str = ""
    until: float = float("inf")
    markers: tuple[str, ...] = ()


@dataclass(frozen=True)
class Renewal:
    """What an update did to a case.

    Attributes:
        moved: Fields of messages that were there before and are there now.
        recounted: Messages missing, too many or of another type, by stamp.
        before, now: Messages by absolute topic [1].
        is_as_before: Nothing moved, and nothing was written.
        is_accepted: Tolerances that were changed are those of the review from now on.
        left: Why the golden bag of before is still there, and where; empty: it is not.
    """

    moved: tuple[Moved, ...]
    recounted: tuple[Divergence, ...]
    before: Mapping[str, int]
    now: Mapping[str, int]
    is_as_before: bool
    is_accepted: bool = False
    left: str = ""


def make_case(folder: Path, source: Source) -> Case:
    """Make a case of a bag.

    Args:
        folder: To create.
        source: The bag, and what it does not say itself.

    Raises:
        BagError, ConfigError, ParameterError: The bag cannot be replayed, or ``folder`` exists.
    """
    if folder.exists():
        raise BagError(f"{folder} exists already; `--update` renews what a case expects")
    refuse_inside(folder, source.bag)
    manipulator = source.manipulator and name_from(folder, source.manipulator)
    try:
        bag = _bring(check_bag(source.bag, NEEDED), folder / BAG, source.until)
        unset = Pinned(folder / GOLDEN, {}, {})
        draft = Case(
            folder, source.about, pin(bag), unset, TOLERANCES,
            manipulator, source.preset, source.settings, source.markers,
        )  # fmt: skip
        bag = replace(configured(bag, draft), path=source.bag)  # nobody knows the copy
        configuration(bag)
        check_settings(bag, draft)
        check_ticks(bag)
        case = replace(draft, golden=pin(write_golden(_faultless(play(bag)), folder / GOLDEN)))
        write_case(case)
        return read_case(folder)  # what it would refuse later, marks say, it refuses now
    except BaseException:
        _discard(folder)
        raise


def update_case(folder: Path) -> Renewal:
    """Let today's messages be what is expected of a case from now on; return what that changed.

    The recorded bag stays as it is: it must still be the one that the case was made with. Where nothing
    moved nothing is written.

    Tolerances that were changed since the last review are accepted, if each holds for some field.

    Raises:
        BagError, ConfigError, ParameterError: The case cannot be judged.
        OSError: Something cannot be written; the case is as it was.
    """
    finish_replacing(folder)
    opened = open_case(folder)
    check_tolerances(opened.case)
    played = _faultless(outcome := play(opened.bag))
    golden, case = opened.golden, opened.case
    moved = find_moved(golden, played, topics_of(golden, played), case.tolerances)
    comparison = compare(opened, outcome)
    is_as_before = not moved and comparison.is_equal and case.is_reviewed
    left = "" if is_as_before else replace_golden(case, partial(write_golden, played))
    recounted = tuple(item for item in comparison.divergences if not item.field)
    counts = golden.counts, played.counts
    return Renewal(tuple(moved), recounted, *counts, is_as_before, not case.is_reviewed, left)


def write_golden(played: Bag, folder: Path) -> Bag:
    """Write what was played into a bag."""
    streams = [stream for name in topics_of(played) if (stream := find_stream(name))]
    with BagWriter(folder, streams, played.custom) as writer:
        for record in played.records:
            writer.write(record.name, record.log_time_ns, record.cdr)
    return check_bag(folder)


def topics_of(*bags: Bag) -> Sequence[str]:
    """Return the topics that bags have messages of, the models first."""
    names = {name for bag in bags for name, count in bag.counts.items() if count}
    return sorted(names, key=lambda name: (name != MODEL, name))


def _faultless(played: Played) -> Bag:
    for topic, text in played.faults.items():
        raise BagError(f"{played.bag.path}: gives no {topic}: {text}")
    return played.bag


def _discard(folder: Path) -> None:
    """Remove what was made of a case; the copy of a write-protected bag is protected, too."""
    for place, _, _ in os.walk(folder):
        with suppress(OSError):
            os.chmod(place, stat.S_IRWXU)
    shutil.rmtree(folder, ignore_errors=True)


def _bring(bag: Bag, folder: Path, until: float) -> Bag:
    """Copy a bag as it is, or write its beginning anew without what depends on the wall clock."""
    if until == float("inf"):
        try:
            shutil.copytree(bag.path, folder)
        except shutil.Error as error:  # a list of what went wrong with each file
            raise BagError(f"{folder} cannot be written: {error.args[0][0][2]}") from None
        return check_bag(folder)
    begin_ns = min(record.log_time_ns for record in bag.records)
    end_ns = begin_ns + round(until * NS_PER_S)
    _refuse_too_early(bag, begin_ns, end_ns)
    kept = [r for r in bag.records if r.log_time_ns < end_ns and r.name not in WALL_CLOCK]
    found = {record.name for record in kept}
    topics = tuple(topic for topic in bag.topics if topic.name in found)
    return copy_bag(replace(bag, topics=topics), folder, kept)


def _refuse_too_early(bag: Bag, begin_ns: int, end_ns: int) -> None:
    """Refuse an end [ns] before the first message on a topic without which there is nothing to replay."""
    for name in NEEDED:
        first_ns = min(record.log_time_ns for record in bag.records if record.name == name)
        if first_ns >= end_ns:
            told = f"within the first {(end_ns - begin_ns) / NS_PER_S:g} s no message on {name}"
            raise BagError(f"{bag.path}: {told}; the first comes at {(first_ns - begin_ns) / NS_PER_S:.3f} s")
