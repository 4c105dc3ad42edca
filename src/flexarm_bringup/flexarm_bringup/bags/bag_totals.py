"""What the metadata of a bag say of it as a whole, against the messages that were read.

rosbag2's recorder (its sequential_writer.cpp) guarantees less than the names promise, and a bag is refused
only where it guarantees more:

- ``message_count`` is the sum over the topics. Those of ``files`` (from version 5 on, none after ``ros2 bag
  reindex``) count what was received, also what its cache then dropped, so they are never fewer.
- ``starting_time`` and ``duration`` are of the times of receipt, also of what was dropped: all messages lie
  in them, and at both ends of them where nothing was dropped. Only where the clock was set back to before the
  beginning is the duration too short; no run is in such a bag, and it is refused.
- Of several files, earlier versions told the last one's times (ros2/rosbag2 issues 841 and 1413), or
  after ``ros2 bag reindex`` the sum of their durations: only times beside all messages are wrong.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rosbags.interfaces import Connection
from rosbags.rosbag2 import Reader, ReaderError

from flexarm_bringup.bags.bag_writer import BagError

METADATA = "metadata.yaml"
COUNT, START, DURATION = "message_count", "starting_time", "duration"


@dataclass(frozen=True)
class Span:
    """Times that the metadata tell.

    Attributes:
        where: Before the key, empty or as "files[0]: ".
        start_ns: Of the first message [ns].
        duration_ns: To the last one [ns].
    """

    where: str
    start_ns: int
    duration_ns: int


@dataclass(frozen=True)
class Totals:
    """What the metadata say of a bag as a whole, and which topics of its data they do not name.

    Attributes:
        count: Messages.
        topics: The same, summed over all topics.
        files: The same, for each file; empty before version 5.
        has_one_file: The data are in one file.
        spans: Times that hold for all messages.
        unnamed: Messages by topic and type of the data that the metadata do not name.
    """

    count: int
    topics: int
    files: tuple[int, ...]
    has_one_file: bool
    spans: tuple[Span, ...]
    unnamed: Mapping[tuple[str, str], int]

    @property
    def is_exact(self) -> bool:
        """Whether the times must be those of messages in the bag: one file, of which nothing was dropped."""
        return self.has_one_file and sum(self.files) == self.count and bool(self.files)


def told_totals(reader: Reader, left_out: AbstractSet[str]) -> Totals:
    """Return what the metadata of an open bag say of it as a whole.

    Args:
        reader: The bag; the numbers of messages of its topics are whole numbers.
        left_out: Topics whose messages are not read.

    Raises:
        ReaderError: Something is not of the kind that it should be.
    """
    about, files = reader.storage.metadata, reader.storage.files
    count = _whole(about.message_count, COUNT)
    start_ns, end_ns = (_whole(time, f"{START} or {DURATION}") for time in (about.start_time, about.end_time))
    spans = [Span("", start_ns, end_ns - 1 - start_ns)]  # rosbags counts the instant after the last
    has_one_file = len(reader.storage.storages) == 1
    if has_one_file and len(files) == 1:
        spans.append(_span_of_file(files[0]))
    return Totals(
        count,
        sum(connection.msgcount for connection in reader.connections),
        tuple(_whole(file.get(COUNT), f"files[{i}]: {COUNT}") for i, file in enumerate(files)),
        has_one_file,
        tuple(spans),
        _unnamed(reader, left_out),
    )


def check_totals(path: Path, told: Totals, stamps_ns: Sequence[int], is_all: bool) -> None:
    """Compare what the metadata say of a bag as a whole with what was read.

    Args:
        path: Folder of the bag.
        told: What they say.
        stamps_ns: When the messages were received [ns], at least one.
        is_all: No topic was left out.

    Raises:
        BagError: Something contradicts the messages.
    """
    for (name, kind), count in told.unnamed.items():
        raise BagError(
            f"{path}: {METADATA}: topics_with_message_count: {name} ({kind}) is not among them, "
            f"the data have {count} messages on it"
        )
    if told.count != told.topics:
        raise BagError(f"{path}: {METADATA}: {COUNT}: {told.count}, those of its topics are {told.topics}")
    if told.files and sum(told.files) < told.count:
        raise BagError(
            f"{path}: {METADATA}: files: {COUNT}: {' + '.join(map(str, told.files))}, "
            f"expected those of its topics, {told.topics}, or more"
        )
    for span in told.spans:
        wrong = _wrong_time(told, span, min(stamps_ns), max(stamps_ns), is_all)
        if wrong:
            raise BagError(f"{path}: {METADATA}: {span.where}{wrong}")


def _wrong_time(told: Totals, span: Span, first_ns: int, last_ns: int, is_all: bool) -> str:
    """Return the key, the value and what was found instead; empty where the times agree with the messages."""
    start_ns, end_ns = span.start_ns, span.start_ns + span.duration_ns
    start = f"{START}: {start_ns} ns, the first message was received at {first_ns} ns"
    duration = f"{DURATION}: {span.duration_ns} ns from {start_ns} ns on, "
    duration += f"the last message was received at {last_ns} ns"
    if span.duration_ns < 0:
        return duration
    if not told.has_one_file:
        return start if start_ns > last_ns else duration if end_ns < first_ns else ""
    is_exact = told.is_exact and is_all
    if start_ns > first_ns or (is_exact and start_ns != first_ns):
        return start
    return duration if end_ns < last_ns or (is_exact and end_ns != last_ns) else ""


def _span_of_file(file: Mapping[str, Any]) -> Span:
    where = "files[0]: "
    start = _whole(file[START]["nanoseconds_since_epoch"], where + START)
    return Span(where, start, _whole(file[DURATION]["nanoseconds"], where + DURATION))


def _unnamed(reader: Reader, left_out: AbstractSet[str]) -> dict[tuple[str, str], int]:
    """Return how many messages the data have on topics, by name and type, that the metadata do not name."""
    named = {(connection.topic, connection.msgtype) for connection in reader.connections}
    unnamed: dict[tuple[str, str], int] = {}
    for storage in reader.storage.storages:
        for connection in storage.connections:
            if _key(connection) not in named and connection.topic not in left_out:
                count = sum(1 for _ in storage.messages([connection]))  # an index may lack them
                unnamed[_key(connection)] = unnamed.get(_key(connection), 0) + count
    return {key: count for key, count in unnamed.items() if count}  # one without messages has lost none


def _key(connection: Connection) -> tuple[str, str]:
    return connection.topic, connection.msgtype


def _whole(value: object, where: str) -> int:
    if type(value) is not int:
        raise ReaderError(f"{where} {value!r} is not a whole number")
    return value
