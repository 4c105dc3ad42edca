"""The layout of rosbag2's metadata.yaml, and bags of each of its versions, for tests.

Written after rosbag2's own documentation of the format and of what each version added: 4 QoS of topics, 5 one
entry per file, 6 custom data, 7 hashes of type descriptions, 8 the distribution, 9 QoS as names.
"""

from __future__ import annotations

import re
import sqlite3
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import yaml
from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag2 import StoragePlugin, Writer

from flexarm_bringup.bags.bag_reader import Record
from flexarm_bringup.bags.bag_types import bag_types

ROOT = "rosbag2_bagfile_information"
ALWAYS = {
    "version", "storage_identifier", "duration", "starting_time", "message_count", "relative_file_paths",
    "topics_with_message_count", "compression_format", "compression_mode",
}  # fmt: skip
ADDED = {5: "files", 6: "custom_data", 8: "ros_distro"}  # at the top level
HASHES, NAMES = 7, 9  # versions from which on topics have a hash, and QoS is a list with names
NO_LIMIT = QosTime(9223372036, 854775807)
_POLICIES = {
    "history": {"system_default", "keep_last", "keep_all", "unknown"},
    "reliability": {"system_default", "reliable", "best_effort", "unknown", "best_available"},
    "durability": {"system_default", "transient_local", "volatile", "unknown", "best_available"},
    "liveliness": {"system_default", "automatic", "manual_by_topic", "unknown", "best_available"},
}
_TIMES = ("deadline", "lifespan", "liveliness_lease_duration")
_HASH = re.compile(r"(RIHS01_[0-9a-f]{64})?")
_TYPE = re.compile(r"[a-z]\w*/(msg|srv|action)/[A-Z]\w*")


def faults(folder: Path) -> list[str]:
    """Return what in a bag's metadata is not as rosbag2 lays it out; nothing when all is well."""
    content = yaml.safe_load((folder / "metadata.yaml").read_text(encoding="utf8"))
    if not isinstance(content, dict) or set(content) != {ROOT}:
        return [f"top level: {ROOT} and nothing else expected"]
    return list(_bag_faults(content[ROOT], folder))


def _bag_faults(bag: dict[str, Any], folder: Path) -> Iterator[str]:
    version = bag.get("version")
    if not isinstance(version, int) or not 4 <= version <= 9:
        yield f"version: {version}"
        return
    keys = ALWAYS | {key for since, key in ADDED.items() if version >= since}
    yield from _keys("bag", bag, keys)
    if keys - set(bag):
        return
    yield from _time("bag", bag)
    counts = [topic.get("message_count") for topic in bag["topics_with_message_count"]]
    if bag["message_count"] != sum(counts):
        yield f"message_count: {bag['message_count']}, topics have {counts}"
    for topic in bag["topics_with_message_count"]:
        yield from _topic_faults(topic, version)
    paths = bag["relative_file_paths"]
    if not paths or not all((folder / path).is_file() for path in paths):
        yield f"relative_file_paths: {paths}"
    if "files" in keys:
        yield from _file_faults(bag["files"], paths, bag["message_count"])
    custom = bag.get("custom_data") or {}
    if not all(isinstance(text, str) for pair in custom.items() for text in pair):
        yield "custom_data: texts by texts expected"


def _file_faults(files: Sequence[dict[str, Any]], paths: Sequence[str], count: int) -> Iterator[str]:
    if [file.get("path") for file in files] != list(paths):
        yield f"files: {files}"
    if sum(file.get("message_count", 0) for file in files) != count:
        yield "files: their message_count"
    for file in files:
        yield from _keys("file", file, {"path", "starting_time", "duration", "message_count"})
        yield from _time("file", file)


def _topic_faults(topic: dict[str, Any], version: int) -> Iterator[str]:
    yield from _keys("topic", topic, {"topic_metadata", "message_count"})
    about = topic["topic_metadata"]
    keys = {"name", "type", "serialization_format", "offered_qos_profiles"}
    keys |= {"type_description_hash"} if version >= HASHES else set()
    yield from _keys("topic_metadata", about, keys)
    if not about["name"].startswith("/") or not _TYPE.fullmatch(about["type"]):
        yield f"topic_metadata: {about['name']} {about['type']}"
    if about["serialization_format"] != "cdr" or not _HASH.fullmatch(about.get("type_description_hash", "")):
        yield f"topic_metadata: {about['name']}: format or hash"
    profiles = about["offered_qos_profiles"]
    if isinstance(profiles, str) != (version < NAMES):
        yield f"{about['name']}: offered_qos_profiles: text before version {NAMES}, a list from then on"
        return
    for profile in yaml.safe_load(profiles) if isinstance(profiles, str) else profiles:
        yield from _qos_faults(profile, version)


def _qos_faults(profile: dict[str, Any], version: int) -> Iterator[str]:
    yield from _keys("qos", profile, {*_POLICIES, *_TIMES, "depth", "avoid_ros_namespace_conventions"})
    for key, names in _POLICIES.items():
        value = profile[key]
        if value not in names if version >= NAMES else not isinstance(value, int):
            yield f"qos: {key}: {value}"
    for key in _TIMES:
        yield from _keys(key, profile[key], {"sec", "nsec"})
        if not all(isinstance(part, int) and 0 <= part < 2**64 for part in profile[key].values()):
            yield f"qos: {key}: {profile[key]}"
    if not isinstance(profile["avoid_ros_namespace_conventions"], bool):
        yield "qos: avoid_ros_namespace_conventions"


def _keys(where: str, found: dict[str, Any], wanted: set[str]) -> Iterator[str]:
    if set(found) != wanted:
        yield f"{where}: missing {sorted(wanted - set(found))}, unknown {sorted(set(found) - wanted)}"


def _time(where: str, item: dict[str, Any]) -> Iterator[str]:
    duration, start = item.get("duration", {}), item.get("starting_time", {})
    if not isinstance(duration.get("nanoseconds"), int) or duration["nanoseconds"] < 0:
        yield f"{where}: duration: {duration}"
    if not isinstance(start.get("nanoseconds_since_epoch"), int):
        yield f"{where}: starting_time: {start}"


def qos(durability: str = "volatile", reliability: str = "reliable", depth: int = 10) -> Qos:
    """Return what a publisher offers."""
    return Qos(
        QosHistory.KEEP_LAST, depth, QosReliability[reliability.upper()], QosDurability[durability.upper()],
        NO_LIMIT, NO_LIMIT, QosLiveliness.AUTOMATIC, NO_LIMIT, False,
    )  # fmt: skip


def write_version(
    folder: Path,
    version: int,
    storage: str,
    topics: dict[str, tuple[str, list[Qos]]],
    records: Sequence[Record],
) -> Path:
    """Write a bag as rosbag2 did in some version.

    Args:
        folder: To create.
        version: Of the metadata, 4 to 9.
        storage: "mcap" or "sqlite3".
        topics: Type and QoS of the publishers by topic.
        records: Messages.
    """
    writer = Writer(folder, version=max(version, 8), storage_plugin=StoragePlugin[storage.upper()])  # type: ignore[arg-type]
    with writer:
        connections = {
            name: writer.add_connection(name, kind, typestore=bag_types(), offered_qos_profiles=offered)
            for name, (kind, offered) in topics.items()
        }
        for record in records:
            writer.write(connections[record.name], record.log_time_ns, record.cdr)
    if version < 8:
        edit_metadata(folder, lambda bag: _back_to(bag, version))
        for path in folder.glob("*.db3"):
            _old_tables(path)
    return folder


def edit_metadata(folder: Path, edit: Callable[[dict[str, Any]], None]) -> None:
    """Change the metadata of a bag."""
    path = folder / "metadata.yaml"
    content = yaml.safe_load(path.read_text(encoding="utf8"))
    edit(content[ROOT])
    path.write_text(yaml.safe_dump(content), encoding="utf8")


def _back_to(bag: dict[str, Any], version: int) -> None:
    """Take away what later versions added."""
    bag["version"] = version
    for since, key in ADDED.items():
        if version < since:
            bag.pop(key, None)
    if version < HASHES:
        for topic in bag["topics_with_message_count"]:
            topic["topic_metadata"].pop("type_description_hash", None)


def _old_tables(path: Path) -> None:
    """Keep what a database had before it had a schema table: topics without hash, and messages."""
    with sqlite3.connect(path) as base:
        for name in ("schema", "metadata", "message_definitions"):
            base.execute(f"DROP TABLE IF EXISTS {name}")
        columns = "id, name, type, serialization_format, offered_qos_profiles"
        base.execute(f"CREATE TABLE old AS SELECT {columns} FROM topics")
        base.execute("DROP TABLE topics")
        base.execute("ALTER TABLE old RENAME TO topics")
    base.close()
