"""Bags read back, after proof that they are whole.

``check_bag`` reads everything once and refuses what a regression must never pass on: no messages,
a topic missing, a type unknown or other than the table says, counts or times that disagree, a data file
cut short, a message that does not decode. Changed bytes are noticed where the bag has a checksum of its
data file, as ours have, or of the chunks in it; in others a number may be another than was recorded.
"""

from __future__ import annotations

import struct
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

if sys.version_info >= (3, 14):
    from compression.zstd import ZstdError
else:
    from backports.zstd import ZstdError

import apsw
from rosbags.interfaces import Connection, Qos
from rosbags.rosbag2 import Reader, ReaderError
from rosbags.serde import SerdeError

from flexarm_bringup.bags.bag_files import check_files
from flexarm_bringup.bags.bag_metadata import announced
from flexarm_bringup.bags.bag_totals import check_totals, told_totals
from flexarm_bringup.bags.bag_types import bag_types
from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.bags.cdr import NS_PER_S

# rosbags lets errors of its parsers through when a file is garbage; a RuntimeError is LZ4's, or a recursion
_BAD_FILE = (
    ReaderError, ZstdError, apsw.Error, OSError, EOFError, ArithmeticError, struct.error, MemoryError,
    RuntimeError,
)  # fmt: skip
_BAD_CONTENT = (*_BAD_FILE, ValueError, LookupError, TypeError, AttributeError, AssertionError)
_BAD_MESSAGE = (SerdeError, ValueError, LookupError, TypeError, struct.error, AssertionError)

Result = TypeVar("Result")


@dataclass(frozen=True)
class Record:
    """One message of a bag.

    Attributes:
        name: Absolute topic.
        type: Message type.
        log_time_ns: When it was received [ns].
        cdr: The serialised message.
    """

    name: str
    type: str
    log_time_ns: int
    cdr: bytes


@dataclass(frozen=True)
class Topic:
    """A topic of a bag.

    Attributes:
        name: Absolute topic.
        type: Message type.
        qos: What its publishers offered, one each; empty where the recorder did not say.
    """

    name: str
    type: str
    qos: tuple[Qos, ...]


@dataclass(frozen=True)
class Bag:
    """A bag that has been proved whole.

    Attributes:
        path: Its folder.
        records: All messages by log time, those of equal time in the order written.
        counts: Messages by absolute topic, (also 0).
        custom: What the recorder said about itself (git hash, configuration).
        topics: All topics with the QoS of their publishers, also those without messages.
        left_out: Topics that were not read: not ours, and of types that nobody here knows.
        has_checksum: Changed bytes of the data file would have been noticed.
        described_by: File of the arm that was named for it, as it does not say its own; else None.
    """

    path: Path
    records: tuple[Record, ...]
    counts: Mapping[str, int]
    custom: Mapping[str, str]
    topics: tuple[Topic, ...] = ()
    left_out: tuple[str, ...] = ()
    has_checksum: bool = False
    described_by: Path | None = None


def decode(record: Record) -> Any:
    """Return the message as an object with the fields of its .msg file (no ROS needed)."""
    return bag_types().deserialize_cdr(record.cdr, record.type)


def trouble_decoding(record: Record) -> str:
    """Return why a message cannot be decoded, and which; empty where it can."""
    try:
        decode(record)
    except _BAD_MESSAGE as error:
        return f"{record.name} at {record.log_time_ns} ns does not decode as {record.type}: {error}"
    return ""


def stamp_of(msg: Any) -> int:
    """Return the stamp in the header of a decoded message [ns]."""
    return int(msg.header.stamp.sec) * NS_PER_S + int(msg.header.stamp.nanosec)


def check_bag(path: Path, required: Sequence[str] = ()) -> Bag:
    """Read a bag and prove that it is whole.

    Args:
        path: Folder of the bag.
        required: Absolute topics that must have messages.

    Raises:
        BagError: It cannot be used; the text is one line with the reason.
    """
    has_checksum = _refuse(path, "cannot be read", lambda: check_files(path))
    reader = _refuse(path, "metadata cannot be read", lambda: Reader(path))
    _refuse(path, "cannot be opened", reader.open)
    try:
        known, counts, custom = _refuse(path, "metadata are wrong", lambda: announced(path, reader))
        topics, left_out = _topics(known), {c.topic for c in reader.connections} - set(counts)
        records = _refuse(path, "data are cut short or changed", lambda: tuple(_records(reader, known)))
        told = _refuse(path, "metadata are wrong", lambda: told_totals(reader, left_out))
    finally:
        reader.close()
    if left_out and not records:
        raise BagError(f"{path}: holds no messages of a known type; left out: {', '.join(sorted(left_out))}")
    _check_counts(path, counts, records)
    check_totals(path, told, [record.log_time_ns for record in records], not left_out)
    _check_required(path, records, required)
    _check_messages(path, records)
    in_order = tuple(sorted(records, key=lambda record: record.log_time_ns))  # files may overlap in time
    return Bag(path, in_order, counts, custom, topics, tuple(sorted(left_out)), has_checksum)


def _records(reader: Reader, known: Sequence[Connection]) -> Iterator[Record]:
    if not known:
        return  # none would stand for all
    _agree_on_qos(reader)
    reader.storage.storages.sort(key=lambda storage: storage.metadata.start_time)  # listed in any order
    for connection, log_time_ns, cdr in reader.messages(known):
        _check_kinds(connection.topic, log_time_ns, cdr)
        yield Record(connection.topic, connection.msgtype, log_time_ns, bytes(cdr))


def _check_kinds(name: str, log_time_ns: object, cdr: object) -> None:
    """Refuse what a database holds in the place of a time or a message: it keeps values of any kind."""
    if type(log_time_ns) is not int:
        raise ReaderError(f"a message on {name} has the time {log_time_ns!r}, a whole number of ns expected")
    if not isinstance(cdr, (bytes, bytearray, memoryview)):
        raise ReaderError(f"a message on {name} is {cdr!r}, bytes expected")


def _agree_on_qos(reader: Reader) -> None:
    """Let the data files say the same of QoS as the metadata, or rosbags would pass over their messages.

    They differ where rosbag2 wrote "no limit" in two ways, or a bag was reindexed.
    """
    said = {(connection.topic, connection.msgtype): connection.ext for connection in reader.connections}
    for storage in reader.storage.storages:
        for i, connection in enumerate(storage.connections):
            ext = said.get((connection.topic, connection.msgtype), connection.ext)
            storage.connections[i] = connection._replace(ext=ext)


def _topics(connections: Sequence[Connection]) -> tuple[Topic, ...]:
    """Return every topic once, with what all of its publishers offered."""
    topics: dict[str, Topic] = {}
    for connection in connections:
        offered = tuple(connection.ext.offered_qos_profiles)
        known = topics.get(connection.topic, Topic(connection.topic, connection.msgtype, ()))
        topics[connection.topic] = Topic(known.name, known.type, (*known.qos, *offered))
    return tuple(topics.values())


def _refuse(path: Path, what: str, action: Callable[[], Result]) -> Result:
    try:
        return action()
    except BagError:
        raise
    except _BAD_CONTENT as error:
        text = " ".join(str(error).split()) or type(error).__name__
        raise BagError(f"{path}: {what}: {text}") from error


def _check_counts(path: Path, counts: Mapping[str, int], records: Sequence[Record]) -> None:
    if not records:
        raise BagError(f"{path}: holds no messages")
    found = Counter(record.name for record in records)
    for name, count in counts.items():
        if found[name] != count:
            raise BagError(f"{path}: {name} has {found[name]} messages, its metadata say {count}")


def _check_required(path: Path, records: Sequence[Record], required: Sequence[str]) -> None:
    found = {record.name for record in records}
    for name in required:
        if name not in found:
            raise BagError(f"{path}: no message on {name}; it has {', '.join(sorted(found))}")


def _check_messages(path: Path, records: Sequence[Record]) -> None:
    for record in records:
        trouble = trouble_decoding(record)
        if trouble:
            raise BagError(f"{path}: {trouble}")
