"""Bags of golden cases made of another one: an arm described otherwise, messages edited, dropped, doubled."""

from __future__ import annotations

import shutil
import tempfile
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from flexarm_bringup.bags.bag_reader import Bag, Record, check_bag, decode
from flexarm_bringup.conversions import deserialise, serialise
from flexarm_bringup.regress.making import Source, make_case
from flexarm_bringup.regress.playing import MODEL, models
from flexarm_bringup.replaying.replay_bag import OUTPUTS
from flexarm_model.conversions import ns_to_stamp, stamp_to_ns

Edit = Callable[[Any], None]
Which = tuple[str, int]  # last part of a topic's name, and the how manieth message of it, from 1 on


def redescribed(recorded: Bag, described: Mapping[str, str]) -> Bag:
    """Return a bag of an arm described otherwise, without what estimator and controller said.

    Raises:
        ValueError: The description has not exactly one of what is to be replaced.
    """
    description = recorded.custom["description"]
    for before, after in described.items():
        if description.count(before) != 1:
            raise ValueError(f"the description has not one '{before}'")
        description = description.replace(before, after)
    bag = replace(
        recorded,
        custom={**recorded.custom, "description": description},
        records=tuple(record for record in recorded.records if record.name not in OUTPUTS),
        topics=tuple(topic for topic in recorded.topics if topic.name not in OUTPUTS),
    )
    (model,) = models(bag)  # a model belongs to one description
    return replace(bag, records=tuple(model if r.name == MODEL else r for r in bag.records))


def with_edits(
    records: Iterable[Record],
    edits: Mapping[Which, Edit],
    also: Mapping[Which, Edit] | None = None,
    without: Collection[Which] = (),
) -> list[Record]:
    """Return messages edited, without some; behind one that is named in ``also`` comes another, edited so."""
    seen: Counter[str] = Counter()
    written: list[Record] = []
    for record in records:
        topic = record.name.rpartition("/")[2]
        seen[topic] += 1
        which = topic, seen[topic]
        if which in without:
            continue
        written.append(edited(record, edits[which]) if which in edits else record)
        if also and which in also:
            written.append(edited(record, also[which]))
    return written


def edited(record: Record, edit: Edit) -> Record:
    """Return a message as an edit leaves it, received when it was."""
    msg = deserialise(record.cdr, record.type)
    edit(msg)
    return replace(record, cdr=serialise(msg, record.type))


def from_then_on(records: Iterable[Record], start_ns: int, shift_ns: int) -> list[Record]:
    """Return messages of which those received from a time on are stamped and received later [ns]."""
    return [
        replace(edited(r, restamped(shift_ns)), log_time_ns=r.log_time_ns + shift_ns)
        if r.log_time_ns >= start_ns
        else r
        for r in records
    ]


def set_first(field: str, value: float) -> Edit:
    """Return an edit of the first element of a field."""
    return lambda msg: getattr(msg, field).__setitem__(0, value)


def restamped(shift_ns: int) -> Edit:
    """Return an edit that stamps later [ns]."""

    def edit(msg: Any) -> None:
        msg.header.stamp = ns_to_stamp(stamp_to_ns(msg.header.stamp) + shift_ns)

    return edit


def remake(case: Path, made_of: Path, change: Callable[[Bag, Path], Bag], about: str, until: float) -> None:
    """Make a case anew of another bag as ``change`` writes it into a folder, and print what its bag has.

    Args:
        case: Its folder, which is replaced.
        made_of: Folder of the other bag.
        change: Writes that bag anew.
        about: What the case is, for the reader.
        until: Only messages logged before this time after the first are kept [s]; infinite: all.
    """
    with tempfile.TemporaryDirectory() as scratch:
        bag = change(check_bag(made_of), Path(scratch) / "changed")
        made = make_case(Path(scratch) / "case", Source(bag.path, about, until=until, markers=("ros",)))
        shutil.rmtree(case, ignore_errors=True)
        shutil.copytree(made.folder, case)
    for name, count in made.bag.counts.items():
        print(f"{count:6d}  {name}")


def outputs_of(case: Path, topic: str) -> list[Any]:
    """Return the messages of a topic, by the last part of its name, that are expected of a case."""
    return [decode(record) for record in check_bag(case / "golden").records if record.name.endswith(topic)]


def same_inputs(made: Bag, kept: Bag) -> bool:
    """Return whether a bag has the messages of a case's, to the bit and as far as the case goes."""
    end_ns = kept.records[-1].log_time_ns
    told = [
        [(r.name, r.log_time_ns, r.cdr) for r in bag.records if r.log_time_ns <= end_ns and r.name != MODEL]
        for bag in (made, kept)  # a model is computed, to rounding
    ]
    return told[0] == told[1]
