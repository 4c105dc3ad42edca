"""Bags as rosbag2 writes them: MCAP, metadata version 9, raw CDR in.

Identical input gives identical files: the data file has a fixed name, topics are declared in the
order given and nothing of the wall clock goes in. ``sha256`` beside the data file lets a reader
notice a flipped byte, which MCAP without checksums does not (``sha256sum -c sha256``).
"""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType, TracebackType

from rosbags.interfaces import (
    Connection,
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.rosbag2.enums import CompressionMode
from rosbags.rosbag2.storage_mcap import McapWriter

from flexarm_bringup.bags.bag_types import bag_types
from flexarm_bringup.topics import Stream

DATA_FILE = "data.mcap"
ORIGIN_FILE = "custom.json"  # custom data, while the metadata are not written yet
CHUNK = 2**17  # bytes that wait in memory for the disk: a fraction of a second of a rig
CHECKSUM_FILE = "sha256"
_FOREVER = QosTime(2147483647, 4294967295)  # rosbag2's way to write "no limit"


class BagError(ValueError):
    """A bag cannot be used; the text is one line that says why."""


class BagWriter:
    """A bag being written; close it in ``finally`` or use ``with``."""

    def __init__(
        self,
        path: Path,
        streams: Sequence[Stream],
        custom: Mapping[str, str],
        offered: Mapping[str, Sequence[Qos]] = MappingProxyType({}),
        files: Mapping[str, Path] = MappingProxyType({}),
    ) -> None:
        """Create the bag.

        Args:
            path: Folder to create.
            streams: Topics that may be written; each appears in the bag, even without messages.
            custom: Kept in the metadata: git hash, configuration.
            offered: QoS of a topic's publishers where it is not that of its row in the table.
            files: Copied into the folder, by relative name: those that the description names.

        Raises:
            BagError: ``path`` exists or cannot be created.
        """
        if path.exists():
            raise BagError(f"{path} exists already")
        self.path = path
        self._writer = _Writer(path, version=9, storage_plugin=StoragePlugin.MCAP)
        for key, value in custom.items():
            self._writer.set_custom_data(key, value)
        try:
            self._writer.open()
            (path / ORIGIN_FILE).write_text(json.dumps(dict(custom)), encoding="utf8")
            _keep(files, path)
        except OSError as error:
            self._writer.abort()
            shutil.rmtree(path, ignore_errors=True)  # or it would stand in the way of the next attempt
            raise BagError(f"{path} cannot be created: {error}") from error
        types = bag_types()
        self._connections = {
            stream.name: self._writer.add_connection(
                stream.name,
                stream.type,
                typestore=types,
                offered_qos_profiles=list(offered.get(stream.name, ())) or [_offered_qos(stream)],
            )
            for stream in streams
        }

    @property
    def counts(self) -> dict[str, int]:
        """Messages written so far by absolute topic."""
        return {name: self._writer.counts[c.id] for name, c in self._connections.items()}

    def write(self, name: str, log_time_ns: int, cdr: bytes) -> None:
        """Append a serialised message.

        Args:
            name: Absolute topic, one of those given at construction.
            log_time_ns: Instant it was received [ns].
            cdr: The message with its encapsulation header.

        Raises:
            OSError: The disk is full.
        """
        self._writer.write(self._connections[name], log_time_ns, cdr)

    def flush(self) -> None:
        """Hand what waits to the disk, unless the bag is closed.

        Raises:
            OSError: The disk is full.
        """
        if self._writer.storage is not None:
            self._writer.storage.flush()

    def close(self) -> None:
        """Write index, metadata and checksum.

        Raises:
            OSError: The disk is full; what was written before stays recoverable.
        """
        if self._writer.storage is None:
            return
        try:
            self._writer.close()
            digest = hashlib.sha256((self.path / DATA_FILE).read_bytes()).hexdigest()
            (self.path / CHECKSUM_FILE).write_text(f"{digest}  {DATA_FILE}\n", encoding="utf8")
            (self.path / ORIGIN_FILE).unlink()
        finally:
            self._writer.abort()  # closes the file where close() could not; else does nothing

    def __enter__(self) -> BagWriter:
        """Return the writer itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close, also when something else failed: half a bag is worth reading."""
        self.close()


def refuse_inside(folder: Path, bag: Path) -> None:
    """Refuse a folder within that of a bag, whose files it would be among.

    Raises:
        BagError: It lies there.
    """
    if folder.resolve().is_relative_to(bag.resolve()):
        raise BagError(f"{folder}: lies in the bag {bag}, and would be a part of it; expected another place")


@contextmanager
def whole_or_nothing(folder: Path) -> Iterator[None]:
    """Remove a folder that is being created when that fails: half of it would be in the way of the next try.

    Raises:
        BagError: It exists already, or the disk refuses.
    """
    if folder.exists():
        raise BagError(f"{folder} exists already")
    try:
        yield
    except BaseException as error:
        shutil.rmtree(folder, ignore_errors=True)
        if isinstance(error, OSError) and error.errno:
            raise BagError(f"{folder} cannot be written: {error.strerror}") from error
        raise


class _DataFile(McapWriter):  # type: ignore[misc]
    """Gives the data file a name that does not depend on the folder's, and keeps little in memory."""

    def __init__(self, path: Path, compression: CompressionMode) -> None:
        super().__init__(path, compression)
        self.path: Path = (path / f"{path.name}.mcap").rename(path / DATA_FILE)

    def write(self, connection: Connection, timestamp: int, data: bytes | memoryview) -> None:
        """Append a message; hand full chunks to the disk."""
        super().write(connection, timestamp, data)
        if self.chunk.bio.tell() > CHUNK:
            self.flush()

    def flush(self) -> None:
        """Hand what waits to the disk; it can be read even if nothing follows."""
        if self.chunk.bio.tell():
            self.close_chunk()
        self.bio.flush()


class _Writer(Writer):  # type: ignore[misc]
    STORAGE_PLUGINS = {StoragePlugin.MCAP: _DataFile}


def _keep(files: Mapping[str, Path], folder: Path) -> None:
    for name, source in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, folder / name)


def _offered_qos(stream: Stream) -> Qos:
    return Qos(
        history=QosHistory.KEEP_LAST,
        depth=stream.depth,
        reliability=QosReliability.RELIABLE,
        durability=QosDurability.TRANSIENT_LOCAL if stream.is_latched else QosDurability.VOLATILE,
        deadline=_FOREVER,
        lifespan=_FOREVER,
        liveliness=QosLiveliness.AUTOMATIC,
        liveliness_lease_duration=_FOREVER,
        avoid_ros_namespace_conventions=False,
    )
