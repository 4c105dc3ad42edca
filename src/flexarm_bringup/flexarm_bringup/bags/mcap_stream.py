"""What is whole in the data file of a bag: its topics and messages, and what has to be doubted.

Chunks of rosbag2 have a checksum: one that does not fit is left out, and said. So is what follows bytes that
can be no record, to the end of their chunk or, between chunks, of the file. A message whose channel has no
name, or whose time is not one of its chunk, is left out.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from rosbags.rosbag2 import ReaderError
from rosbags.rosbag2.metadata import parse_qos

from flexarm_bringup.bags.bag_definitions import is_another
from flexarm_bringup.bags.bag_reader import Record, Topic
from flexarm_bringup.bags.bag_types import bag_types
from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.bags.mcap_records import (
    CHANNEL,
    CHUNK,
    COMPRESSIONS,
    MAGIC,
    MESSAGE,
    SCHEMA,
    Chunk,
    DamagedError,
    Piece,
    open_chunk,
    pieces,
    text,
    texts,
)
from flexarm_bringup.bags.packed_message import unpacked
from flexarm_bringup.topics import find_stream

NAMING = (SCHEMA, CHANNEL)  # records that say what topics are called
QOS = "offered_qos_profiles"
MSG = "ros2msg"  # encoding of a definition as it stands in a .msg file
S_PER_NS = 1e-9
_SHORT = struct.Struct("<H")
_MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time
_GARBLED = (struct.error, UnicodeDecodeError, LookupError, ReaderError)


@dataclass
class McapStream:
    """What has been read so far.

    Attributes:
        path: The file.
        types: Message types by number.
        channels: Topics of known types by number; None: its type is not known.
        topics: Topics of known types by name.
        records: Messages, as they follow one another, none of them compressed.
        doubts: Sentences about what is left out.
        astray: How many messages belong to no topic or time.
    """

    path: Path
    types: dict[int, str] = field(default_factory=dict)
    channels: dict[int, Topic | None] = field(default_factory=dict)
    topics: dict[str, Topic] = field(default_factory=dict)
    records: list[Record] = field(default_factory=list)
    doubts: list[str] = field(default_factory=list)
    astray: int = 0

    def read(self, data: bytes) -> None:
        """Read a file.

        Raises:
            BagError: It is empty, or not MCAP, or compressed.
        """
        if not data:
            raise BagError(f"{self.path}: is empty: the recorder ended before anything was written")
        if not data.startswith(MAGIC):
            raise BagError(f"{self.path}: is not an MCAP file")
        content = memoryview(data)[len(MAGIC) :]
        at = len(MAGIC)
        self._read(content, at, NAMING)  # a file that was closed says at its end, too, what topics are called
        self._read(content, at, (*NAMING, MESSAGE, CHUNK))
        if self.astray:
            why = "of no topic that is named, or of a time that is not one of their chunk"
            self.doubts.append(f"messages left out, {why}: {self.astray}")
        self.doubts = list(dict.fromkeys(self.doubts))

    def _read(self, data: memoryview, at: int, opcodes: Sequence[int], chunk: Chunk | None = None) -> None:
        """Take records of some kinds, of a chunk or of the file."""
        piece = None
        try:
            for piece in pieces(data, at, chunk.length if chunk else None):
                if piece.opcode in opcodes:
                    self._take(piece, chunk)
        except DamagedError as error:
            self._leave_out(error, at + len(data), chunk)
        except _GARBLED:
            if piece is not None and piece.is_whole:  # else the file ends in its header
                self._leave_out(DamagedError(piece.at), at + len(data), chunk)

    def _leave_out(self, damage: DamagedError, end: int, chunk: Chunk | None) -> None:
        where = "of its chunk" if chunk else "of the file"
        lost = f"what follows to the end {where}, byte {end}, is left out"
        self.doubts.append(f"{self.path.name} is {damage}: {lost}")

    def _take(self, piece: Piece, chunk: Chunk | None) -> None:
        if piece.opcode == SCHEMA:
            self._on_schema(piece.content)
        elif piece.opcode == CHANNEL:
            self._on_channel(piece.content)
        elif piece.opcode == MESSAGE:
            self._on_message(piece.content, chunk)
        else:
            self._on_chunk(piece)

    def _on_schema(self, content: memoryview) -> None:
        (number,) = _SHORT.unpack_from(content)
        kind, at = text(content, 2)
        encoding, at = text(content, at)
        if encoding == MSG and is_another(kind, text(content, at)[0]):
            self.doubts.append(f"messages of {kind} are left out: recorded with another definition")
            kind = f"another {kind}"  # which nobody knows
        self.types[number] = kind

    def _on_channel(self, content: memoryview) -> None:
        number, schema = _SHORT.unpack_from(content)[0], _SHORT.unpack_from(content, 2)[0]
        name, at = text(content, 4)
        _, at = text(content, at)
        kind, about = self.types[schema], dict(texts(content, at))
        if kind in bag_types().types:
            topic = Topic(name, kind, tuple(parse_qos(about.get(QOS, ""))))
            self.channels[number] = topic
            self.topics.setdefault(name, topic)
        else:
            self.channels.setdefault(number, None)

    def _on_message(self, content: memoryview, chunk: Chunk | None) -> None:
        number, _, log_time_ns, _ = _MESSAGE.unpack_from(content)
        is_in_time = chunk is None or chunk.begin_ns <= log_time_ns <= chunk.end_ns
        if number not in self.channels or not is_in_time:
            self.astray += 1
            return
        topic = self.channels[number]
        if topic is not None:
            cdr = unpacked(bytes(content[_MESSAGE.size :]))
            self.records.append(Record(topic.name, topic.type, log_time_ns, cdr))

    def _on_chunk(self, piece: Piece) -> None:
        chunk = open_chunk(piece)
        if chunk.compression in COMPRESSIONS:
            how = chunk.compression
            raise BagError(f"{self.path}: chunks are compressed with {how}; only others are recovered")
        if chunk.checksum and piece.is_whole and zlib.crc32(chunk.records) != chunk.checksum:
            times = f"{chunk.begin_ns * S_PER_NS:.9f} to {chunk.end_ns * S_PER_NS:.9f} s"
            self.doubts.append(f"the messages of {times} are left out: their chunk was changed (CRC differs)")
            self._name_topics(chunk)
        elif chunk.compression or not chunk.is_sound:
            self.doubts.append(f"{self.path.name} is {DamagedError(piece.at)}: the chunk there is left out")
        else:
            self._read(chunk.records, chunk.at, (*NAMING, MESSAGE), chunk)

    def _name_topics(self, chunk: Chunk) -> None:
        """Take from a chunk that was changed what it calls topics of the table: it may be the only one."""
        named = McapStream(self.path, dict(self.types))
        named._read(chunk.records, chunk.at, NAMING, chunk)
        for number, topic in named.channels.items():
            stream = find_stream(topic.name) if topic else None
            if topic is not None and stream is not None and stream.type == topic.type:
                self.channels.setdefault(number, topic)
                self.topics.setdefault(topic.name, topic)
