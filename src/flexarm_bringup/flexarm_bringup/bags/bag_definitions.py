"""What the data files of a bag say of their message types, against what the types are here.

Metadata have hashes of type descriptions from version 7 on only. A data file may tell more: MCAP and newer
databases hold the text of every definition and the hash that its recorder knew. Two texts are the same
definition where their hashes agree (RIHS01, REP-2016): comments, spaces, constants and the order of what they
refer to have no say in it. A text in IDL is not looked at.
"""

from __future__ import annotations

from collections.abc import Iterator
from collections.abc import Set as AbstractSet
from functools import lru_cache
from pathlib import Path
from typing import Any

from rosbags.interfaces import Connection, MessageDefinitionFormat
from rosbags.rosbag2 import Reader
from rosbags.typesys import TypesysError, get_types_from_msg
from rosbags.typesys.store import Typestore

from flexarm_bringup.bags.bag_types import bag_types
from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.bags.mcap_records import texts

HASH = "topic_type_hash"  # key of a channel of MCAP, since rosbag2 writes hashes
_NO_DEFINITION = (TypesysError, ValueError, LookupError, TypeError, AssertionError, RecursionError)


def check_definitions(path: Path, reader: Reader, topics: AbstractSet[tuple[str, str]]) -> None:
    """Compare the definitions in the data files of an open bag with those known here.

    Args:
        path: Folder of the bag.
        reader: The bag.
        topics: Names and types, known here, that are looked at.

    Raises:
        BagError: A data file was written with another definition, or with one that nobody understands.
    """
    for storage in reader.storage.storages:
        for connection in storage.connections:
            if (connection.topic, connection.msgtype) in topics:
                for found in _told_hashes(path, storage, connection):
                    check_hash(path, connection.topic, connection.msgtype, found)


def check_hash(path: Path, name: str, kind: str, found: str) -> None:
    """Compare the hash of a type with which a topic was recorded with that of the type here.

    Raises:
        BagError: It is another.
    """
    if found and found != bag_types().hash_rihs01(kind):
        raise BagError(f"{path}: {name} was recorded with another definition of {kind}")


@lru_cache(maxsize=256)
def definition_hash(kind: str, text: str) -> str:
    """Return the hash of a definition, "RIHS01_" and 64 digits; what the text refers to and lacks is ours.

    Raises:
        BagError: Nobody understands the text.
    """
    store = Typestore()
    try:
        store.fielddefs = {**bag_types().fielddefs, **get_types_from_msg(text, kind)}
        return str(store.hash_rihs01(kind))
    except _NO_DEFINITION as error:
        raise BagError(f"the definition of {kind} is none ({type(error).__name__})") from error


def is_another(kind: str, text: str) -> bool:
    """Return whether a text certainly defines a known type otherwise; one that nobody understands may not."""
    try:
        return kind in bag_types().types and definition_hash(kind, text) != bag_types().hash_rihs01(kind)
    except BagError:
        return False


def _told_hashes(path: Path, storage: Any, connection: Connection) -> Iterator[str]:
    """Yield the hashes of a topic's type that a data file tells, and that of its text."""
    yield connection.digest
    channel = getattr(storage, "channels", {}).get(connection.id)  # rosbags passes over what MCAP says of it
    if channel is not None:
        about = len(channel.metadata).to_bytes(4, "little") + channel.metadata
        yield dict(texts(memoryview(about), 0)).get(HASH, "")
    if connection.msgdef.format == MessageDefinitionFormat.MSG:
        try:
            yield definition_hash(connection.msgtype, connection.msgdef.data)
        except BagError as error:
            raise BagError(f"{path}: {connection.topic}: {error}") from error
