"""What a recorder left that was killed or ran out of disk: a data file without an index, read as a stream.

Records of an MCAP file follow one another, ``opcode (1), length (8), content``, and chunks hold more of them.
They are read until the file ends in the middle of one; every message before that is whole. Chunks of rosbag2
have a checksum: one that does not fit is left out, and said. Those of our recorder have none; that of a whole
file, which it leaves when it closes it, tells of changes but not where they are.
"""

from __future__ import annotations

import hashlib
import json
import struct
import zlib
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import yaml
from rosbags.rosbag2 import ReaderError
from rosbags.rosbag2.metadata import parse_qos

from flexarm_bringup.bags.bag_copy import copy_bag
from flexarm_bringup.bags.bag_reader import Bag, Record, Topic
from flexarm_bringup.bags.bag_types import bag_types
from flexarm_bringup.bags.bag_writer import CHECKSUM_FILE, ORIGIN_FILE, BagError, refuse_inside
from flexarm_bringup.topics import find_stream

MAGIC = b"\x89MCAP0\r\n"
SCHEMA, CHANNEL, MESSAGE, CHUNK = 0x03, 0x04, 0x05, 0x06
NAMING = (SCHEMA, CHANNEL)  # records that say what topics are called
QOS = "offered_qos_profiles"
METADATA, INFORMATION = "metadata.yaml", "rosbag2_bagfile_information"
S_PER_NS = 1e-9
_RECORD, _SHORT, _LENGTH = struct.Struct("<BQ"), struct.Struct("<H"), struct.Struct("<I")
_MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time
_CHUNK = struct.Struct("<QQQI")  # first and last time, size, checksum
_SIZE = struct.Struct("<Q")


@dataclass(frozen=True)
class Recovery:
    """What was saved.

    Attributes:
        bag: The new bag, read back; its custom data are those that the recorder began with.
        doubts: Sentences about what was left out or is not what was recorded.
    """

    bag: Bag
    doubts: tuple[str, ...] = ()


def recover_bag(path: Path, folder: Path) -> Recovery:
    """Write everything whole of a broken bag into a new one.

    Args:
        path: Folder of the broken bag, with one MCAP file in it.
        folder: To create.

    Raises:
        BagError: There is no such file, nothing in it is whole, or ``folder`` exists or
            lies in the broken bag.
    """
    if not path.is_dir():
        raise BagError(
            f"{path}: " + ("is a file; expected the folder of a bag" if path.exists() else "no such folder")
        )
    files = sorted(path.glob("*.mcap"))
    if len(files) != 1:
        other = "; SQLite is not recovered here, ros2 bag reindex does" if any(path.glob("*.db3")) else ""
        raise BagError(f"{path}: has {len(files)} MCAP files, one expected{other}")
    refuse_inside(folder, path)
    data, found = files[0].read_bytes(), _Stream(files[0])
    found.read(data)
    doubts = (*found.doubts, *_doubts_of_file(files[0], data), *_doubts_of_count(path, len(found.records)))
    if not found.records:
        raise BagError("; ".join((f"{files[0]}: holds no whole message of a known type", *doubts)))
    records = tuple(sorted(found.records, key=lambda record: record.log_time_ns))
    counts = Counter(record.name for record in records)
    topics = tuple(found.topics.values())
    return Recovery(copy_bag(Bag(path, records, counts, _origin(path), topics), folder, records), doubts)


@dataclass
class _Stream:
    """What has been read so far."""

    path: Path
    types: dict[int, str] = field(default_factory=dict)
    channels: dict[int, Topic] = field(default_factory=dict)
    topics: dict[str, Topic] = field(default_factory=dict)
    records: list[Record] = field(default_factory=list)
    doubts: list[str] = field(default_factory=list)

    def read(self, data: bytes) -> None:
        """Read a file.

        Raises:
            BagError: It is empty, or not MCAP.
        """
        if not data:
            raise BagError(f"{self.path}: is empty: the recorder ended before anything was written")
        if not data.startswith(MAGIC):
            raise BagError(f"{self.path}: is not an MCAP file")
        content = memoryview(data)[len(MAGIC) :]
        self._read_records(
            content, NAMING
        )  # a file that was closed says at its end, too, what topics are called
        self._read_records(content, (*NAMING, MESSAGE, CHUNK))

    def _read_records(self, data: memoryview, opcodes: Sequence[int]) -> None:
        take = {SCHEMA: self._on_schema, CHANNEL: self._on_channel, MESSAGE: self._on_message}
        for opcode, content, is_whole in _records(data):
            if opcode not in opcodes:
                continue
            try:
                if opcode == CHUNK:
                    self._on_chunk(content, is_whole)
                else:
                    take[opcode](content)
            except (struct.error, UnicodeDecodeError, LookupError, ReaderError):
                return  # the end of what is whole

    def _on_schema(self, content: memoryview) -> None:
        (number,) = _SHORT.unpack_from(content)
        self.types[number], _ = _text(content, 2)

    def _on_channel(self, content: memoryview) -> None:
        number, schema = _SHORT.unpack_from(content)[0], _SHORT.unpack_from(content, 2)[0]
        name, at = _text(content, 4)
        _, at = _text(content, at)
        kind, about = self.types[schema], dict(_texts(content, at))
        if kind in bag_types().types:
            self.channels[number] = Topic(name, kind, tuple(parse_qos(about.get(QOS, ""))))
            self.topics.setdefault(name, self.channels[number])

    def _on_message(self, content: memoryview) -> None:
        number, _, log_time_ns, _ = _MESSAGE.unpack_from(content)
        topic = self.channels.get(number)
        if topic is not None:
            cdr = bytes(content[_MESSAGE.size :])
            self.records.append(Record(topic.name, topic.type, log_time_ns, cdr))

    def _on_chunk(self, content: memoryview, is_whole: bool) -> None:
        begin_ns, end_ns, _, checksum = _CHUNK.unpack_from(content)
        compression, at = _text(content, _CHUNK.size)
        if compression:
            raise BagError(
                f"{self.path}: chunks are compressed with {compression}; only others are recovered"
            )
        (size,), records = _SIZE.unpack_from(content, at), content[at + _SIZE.size :]
        if checksum and is_whole and (len(records) != size or zlib.crc32(records) != checksum):
            times = f"{begin_ns * S_PER_NS:.9f} to {end_ns * S_PER_NS:.9f} s"
            self.doubts.append(f"the messages of {times} are left out: their chunk was changed (CRC differs)")
            self._name_topics(records)
        else:
            self._read_records(records, (*NAMING, MESSAGE))

    def _name_topics(self, records: memoryview) -> None:
        """Take from a chunk that was changed what it calls topics of the table: it may be the only one."""
        named = _Stream(self.path, dict(self.types))
        named._read_records(records, NAMING)
        for number, topic in named.channels.items():
            stream = find_stream(topic.name)
            if stream is not None and stream.type == topic.type:
                self.topics.setdefault(topic.name, self.channels.setdefault(number, topic))


def _doubts_of_file(path: Path, data: bytes) -> tuple[str, ...]:
    """Return what the checksum has to say that our recorder leaves beside a file that it closed."""
    try:
        said = (path.parent / CHECKSUM_FILE).read_text(encoding="utf8", errors="replace").split()
    except OSError:
        return ()
    if said[1:] != [path.name] or said[0] == hashlib.sha256(data).hexdigest():
        return ()
    return (f"{path.name} is not what was recorded (SHA-256 differs): any message may be changed or missing",)


def _doubts_of_count(path: Path, count: int) -> tuple[str, ...]:
    """Return what a recorder that closed its bag has to say of a file that was cut off since."""
    told = _metadata(path, "message_count")
    if not isinstance(told, int) or told <= count:
        return ()
    missing = "are missing, damaged or of a type that is not known here"
    return (f"{METADATA} tells of {told} messages: {told - count} {missing}",)


def _records(data: memoryview) -> Iterator[tuple[int, memoryview, bool]]:
    """Yield opcode and content of every record and whether it is whole; of a cut chunk what there is."""
    at = 0
    while at + _RECORD.size <= len(data):
        opcode, length = _RECORD.unpack_from(data, at)
        at += _RECORD.size
        if at + length > len(data) and opcode != CHUNK:
            return
        yield opcode, data[at : at + length], at + length <= len(data)
        at += length


def _text(content: memoryview, at: int) -> tuple[str, int]:
    (length,) = _LENGTH.unpack_from(content, at)
    start = at + _LENGTH.size
    return str(bytes(content[start : start + length]), "utf8"), start + length


def _texts(content: memoryview, at: int) -> Iterator[tuple[str, str]]:
    (length,) = _LENGTH.unpack_from(content, at)
    at += _LENGTH.size
    end = at + length
    while at < end:
        key, at = _text(content, at)
        value, at = _text(content, at)
        yield key, value


def _metadata(path: Path, key: str) -> object:
    """Return what a recorder that closed its bag has written beside it; None where it has not."""
    try:
        return yaml.safe_load((path / METADATA).read_text(encoding="utf8"))[INFORMATION][key]
    except (OSError, UnicodeDecodeError, yaml.YAMLError, LookupError, TypeError):
        return None


def _origin(path: Path) -> dict[str, str]:
    """Return the custom data that the recorder began with; none where it was another program."""
    try:
        content = json.loads((path / ORIGIN_FILE).read_text(encoding="utf8"))
    except FileNotFoundError:
        content = _metadata(path, "custom_data")  # the recorder has closed its bag
    except (OSError, ValueError):
        return {}
    return {str(key): str(value) for key, value in content.items()} if isinstance(content, dict) else {}
