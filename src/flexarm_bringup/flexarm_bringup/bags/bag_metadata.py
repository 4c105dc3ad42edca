"""What the metadata of a bag announce, and its data files of types, checked before a message is read."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

from rosbags.interfaces import Connection
from rosbags.rosbag2 import Reader, ReaderError

from flexarm_bringup.bags.bag_definitions import check_definitions, check_hash
from flexarm_bringup.bags.bag_types import bag_types
from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.topics import find_stream


def announced(path: Path, reader: Reader) -> tuple[list[Connection], Counter[str], dict[str, str]]:
    """Return the topics that can be read, how many messages each name should have, and the custom data.

    Raises:
        BagError: A topic has another type than the table says, or one with another definition.
        ReaderError: Something is not of the kind that it should be.
    """
    counts: Counter[str] = Counter()
    for connection in reader.connections:
        if not all(isinstance(t, str) and t.isprintable() for t in (connection.topic, connection.msgtype)):
            raise ReaderError(f"a topic {connection.topic!r} of type {connection.msgtype!r}")
        if type(connection.msgcount) is not int:
            raise ReaderError(f"{connection.topic} has {connection.msgcount!r} messages")
    known = [connection for connection in reader.connections if not _is_foreign(connection)]
    for connection in known:
        counts[connection.topic] += connection.msgcount
        _check_type(path, connection)
    with_messages = {(connection.topic, connection.msgtype) for connection in known if connection.msgcount}
    check_definitions(path, reader, with_messages)  # of the others nothing is misread
    custom = reader.storage.metadata.custom or {}
    if not isinstance(custom, dict):
        raise ReaderError(f"custom_data are not values by name, but {type(custom).__name__}")
    # rosbag2 writes texts without quotes: one that looks like a number is read as a number
    return known, counts, {str(key): "" if value is None else str(value) for key, value in custom.items()}


def instead_of_metadata(path: Path) -> str:
    """Return what a folder without metadata may be, and what can be done."""
    if len(list(path.glob("*.mcap"))) == 1:
        return f"its recorder was killed? `flexarm recover {path} --output DIR` saves what is whole"
    return "not a bag, or its recorder was killed"


def _is_foreign(connection: Connection) -> bool:
    """Return whether a topic is not of the table and its type of a package that nobody here knows."""
    packages = {kind.split("/")[0] for kind in bag_types().types}
    return find_stream(connection.topic) is None and connection.msgtype.split("/")[0] not in packages


def _check_type(path: Path, connection: Connection) -> None:
    name, kind = connection.topic, connection.msgtype
    stream = find_stream(name)
    if stream is not None and stream.type != kind:
        raise BagError(f"{path}: {name} has type {kind}, {stream.type} expected")
    if kind not in bag_types().types:
        raise BagError(f"{path}: {name} has an unknown type {kind}")
    check_hash(path, name, kind, connection.digest)
