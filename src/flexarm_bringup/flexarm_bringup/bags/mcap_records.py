"""Records of an MCAP file as a stream: ``opcode (1), length (8), content``, one behind the other.

What can be none is noticed: an opcode that MCAP does not have, a length beyond what the record lies in, a
chunk whose lengths contradict each other. Bytes that were changed within the content of a message are not.
(MCAP specification, mcap.dev/spec)
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass

MAGIC = b"\x89MCAP0\r\n"
SCHEMA, CHANNEL, MESSAGE, CHUNK = 0x03, 0x04, 0x05, 0x06
KNOWN, OWN = range(0x01, 0x10), range(0x80, 0x100)  # opcodes of the specification, and left to applications
COMPRESSIONS = ("zstd", "lz4")
LONGEST = 2**31  # bytes of a record that a file may end in: longer is no length
_RECORD, _LENGTH = struct.Struct("<BQ"), struct.Struct("<I")
_CHUNK = struct.Struct("<QQQI")  # first and last time, size, checksum
_SIZE = struct.Struct("<Q")


class DamagedError(ValueError):
    """At a byte there is what can be no record; what follows cannot be told apart."""

    def __init__(self, at: int) -> None:
        """Name the byte, counted from the begin of the file."""
        super().__init__(f"damaged at byte {at}")


@dataclass(frozen=True)
class Piece:
    """A record.

    Attributes:
        opcode: What it is.
        content: Its content; of a chunk that the file ends in what there is.
        at: Where in the file the record begins.
        length: Of the content, were it whole.
    """

    opcode: int
    content: memoryview
    at: int
    length: int

    @property
    def is_whole(self) -> bool:
        """Whether the file does not end in it."""
        return len(self.content) == self.length


@dataclass(frozen=True)
class Chunk:
    """A chunk, opened.

    Attributes:
        begin_ns: Time of its first message [ns].
        end_ns: Of its last.
        records: What it holds, as it was written.
        at: Where in the file they begin.
        length: Of the records, were the chunk whole.
        checksum: CRC32 of the records; 0 where there is none.
        compression: Its name; empty: none.
        is_sound: Its lengths agree with each other.
    """

    begin_ns: int
    end_ns: int
    records: memoryview
    at: int
    length: int
    checksum: int
    compression: str
    is_sound: bool


def pieces(data: memoryview, at: int = 0, length: int | None = None) -> Iterator[Piece]:
    """Yield every record that is whole, and a chunk that the data end in.

    Args:
        data: Records, in bytes.
        at: Where in the file they begin.
        length: Theirs, were the file whole; None: of a file, whose end is not known.

    Raises:
        DamagedError: What follows can be no record.
    """
    begin, end = 0, len(data) + LONGEST if length is None else length
    while begin + _RECORD.size <= len(data):
        opcode, size = _RECORD.unpack_from(data, begin)
        content = begin + _RECORD.size
        if content + size > end or not (opcode in KNOWN or opcode in OWN):
            raise DamagedError(at + begin)
        if content + size <= len(data) or opcode == CHUNK:
            yield Piece(opcode, data[content : content + size], at + begin, size)
        begin = content + size
    if begin < end == len(data):
        raise DamagedError(at + begin)  # a few bytes are left over


def open_chunk(piece: Piece) -> Chunk:
    """Return what a chunk says of itself and holds.

    Raises:
        struct.error, UnicodeDecodeError: The file ends in its header, or that was changed.
    """
    begin_ns, end_ns, size, checksum = _CHUNK.unpack_from(piece.content)
    compression, at = text(piece.content, _CHUNK.size)
    (length,) = _SIZE.unpack_from(piece.content, at)
    at += _SIZE.size
    is_sound = at + length == piece.length and (bool(compression) or size == length)
    start = piece.at + _RECORD.size + at
    return Chunk(begin_ns, end_ns, piece.content[at:], start, length, checksum, compression, is_sound)


def text(content: memoryview, at: int) -> tuple[str, int]:
    """Return a text that stands at a byte, and where it ends."""
    (length,) = _LENGTH.unpack_from(content, at)
    start = at + _LENGTH.size
    return str(bytes(content[start : start + length]), "utf8"), start + length


def texts(content: memoryview, at: int) -> Iterator[tuple[str, str]]:
    """Yield pairs of texts, key and value."""
    (length,) = _LENGTH.unpack_from(content, at)
    at += _LENGTH.size
    end = at + length
    while at < end:
        key, at = text(content, at)
        value, at = text(content, at)
        yield key, value
