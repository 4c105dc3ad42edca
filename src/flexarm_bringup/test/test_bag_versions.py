"""Bags as rosbag2 has written them from version 4 on are read; what we write is laid out as rosbag2 does."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from bag_fixture import PERIOD_NS, joint_state, modal_state, write_bag
from rosbag2_layout import NO_LIMIT, edit_metadata, faults, qos, write_version
from rosbags.interfaces import QosTime
from rosbags.rosbag2 import CompressionFormat, CompressionMode, Reader, StoragePlugin, Writer

from flexarm_bringup.bags.bag_copy import copy_bag
from flexarm_bringup.bags.bag_reader import Record, check_bag, decode
from flexarm_bringup.bags.bag_types import bag_types
from flexarm_bringup.bags.bag_writer import BagError

JOINTS, MODAL, MODEL, ODOM = "/flexarm/joint_states", "/flexarm/modal_state", "/flexarm/model", "/odom"
TOPICS = {
    MODEL: ("flexarm_interfaces/msg/ReducedModel", [qos("transient_local", depth=500)]),
    JOINTS: ("sensor_msgs/msg/JointState", [qos(reliability="best_effort"), qos(depth=3)]),
    ODOM: ("sensor_msgs/msg/JointState", [qos("transient_local", depth=1)]),
    MODAL: ("flexarm_interfaces/msg/ModalState", [qos()]),
}
RECORDS = [
    Record(name, TOPICS[name][0], k * PERIOD_NS, write(k * PERIOD_NS))
    for k in range(3)
    for name, write in (
        (JOINTS, lambda stamp_ns: joint_state(stamp_ns, 0.5)),
        (ODOM, lambda stamp_ns: joint_state(stamp_ns, 0.25)),
        (MODAL, modal_state),
    )
]
STORAGES = ("mcap", "sqlite3")
SLOW_VERSIONS = [pytest.param(version, marks=pytest.mark.slow) for version in (5, 6, 7)]  # between the others


@pytest.mark.parametrize("storage", STORAGES)
@pytest.mark.parametrize("version", [4, *SLOW_VERSIONS, 8, 9])
def test_bags_of_every_version_and_storage_are_read(version: int, storage: str, tmp_path: Path) -> None:
    path = write_version(tmp_path / "bag", version, storage, TOPICS, RECORDS)
    assert faults(path) == []
    bag = check_bag(path, [JOINTS])
    assert list(bag.records) == RECORDS
    assert dict(bag.counts) == {MODEL: 0, JOINTS: 3, ODOM: 3, MODAL: 3}
    assert {topic.name: (topic.type, list(topic.qos)) for topic in bag.topics} == TOPICS


@pytest.mark.parametrize("version", [4, 9])
def test_a_bag_written_anew_keeps_latched_topics_and_qos(version: int, tmp_path: Path) -> None:
    bag = check_bag(write_version(tmp_path / "bag", version, "sqlite3", TOPICS, RECORDS))
    again = copy_bag(bag, tmp_path / "again", bag.records[:4])
    assert again.topics == bag.topics
    assert again.records == bag.records[:4]
    assert faults(again.path) == []
    with Reader(again.path) as reader:  # rosbags itself finds them there, too
        offered = {c.topic: c.ext.offered_qos_profiles[0].durability.name for c in reader.connections}
    assert offered == {
        MODEL: "TRANSIENT_LOCAL",
        JOINTS: "VOLATILE",
        ODOM: "TRANSIENT_LOCAL",
        MODAL: "VOLATILE",
    }


def test_what_we_write_is_laid_out_as_rosbag2_does(tmp_path: Path) -> None:
    assert faults(write_bag(tmp_path / "bag")) == []


def drop(key: str) -> Callable[[dict[str, Any]], None]:
    return lambda bag: bag.pop(key)


def put(value: Any, *keys: Any) -> Callable[[dict[str, Any]], None]:
    def edit(bag: dict[str, Any]) -> None:
        for key in keys[:-1]:
            bag = bag[key]
        bag[keys[-1]] = value

    return edit


FIRST = ("topics_with_message_count", 0, "topic_metadata")
WRONG = {
    "version": put("9", "version"),
    "no files": drop("files"),
    "no custom data": drop("custom_data"),
    "no distribution": drop("ros_distro"),
    "an unknown key": put(1, "author"),
    "wrong total": put(5, "message_count"),
    "wrong count of a file": put(5, "files", 0, "message_count"),
    "missing file": put(["other.mcap"], "relative_file_paths"),
    "negative duration": put(-1, "duration", "nanoseconds"),
    "no start": put({}, "starting_time"),
    "QoS as text": put("", *FIRST, "offered_qos_profiles"),
    "QoS as numbers": put(1, *FIRST, "offered_qos_profiles", 0, "durability"),
    "QoS without depth": lambda bag: bag["topics_with_message_count"][0]["topic_metadata"][
        "offered_qos_profiles"
    ][0].pop("depth"),
    "negative deadline": put(-1, *FIRST, "offered_qos_profiles", 0, "deadline", "sec"),
    "short hash": put("RIHS01_12", *FIRST, "type_description_hash"),
    "type without its folder": put("sensor_msgs/JointState", *FIRST, "type"),
    "another serialisation": put("json", *FIRST, "serialization_format"),
    "numbers as custom data": put({"run": 7}, "custom_data"),
}


QUICK = ("no files", "wrong total", "QoS as text")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name in QUICK else [pytest.mark.slow]) for name in WRONG]
)
def test_the_check_of_the_layout_finds_what_is_wrong(name: str, tmp_path: Path) -> None:
    path = write_bag(tmp_path / "bag")
    edit_metadata(path, WRONG[name])
    assert faults(path)


@pytest.mark.parametrize("storage", STORAGES)
def test_no_limit_written_in_two_ways_hides_no_messages(storage: str, tmp_path: Path) -> None:
    path = write_version(tmp_path / "bag", 9, storage, TOPICS, RECORDS)
    old = QosTime(2147483647, 4294967295)
    assert old != NO_LIMIT
    text = (path / "metadata.yaml").read_text()
    (path / "metadata.yaml").write_text(text.replace("sec: 9223372036", f"sec: {old.sec}"))
    assert list(check_bag(path).records) == RECORDS


@pytest.mark.slow
@pytest.mark.parametrize("mode", [CompressionMode.MESSAGE, CompressionMode.FILE])
def test_compressed_bags_are_read(mode: CompressionMode, tmp_path: Path) -> None:
    writer = Writer(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.SQLITE3)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        kind, offered = TOPICS[JOINTS]
        connection = writer.add_connection(JOINTS, kind, typestore=bag_types(), offered_qos_profiles=offered)
        writer.write(connection, 7, joint_state(7, 0.5))
    (record,) = check_bag(tmp_path / "bag").records
    assert decode(record).position[0] == 0.5


def other_package(bag: dict[str, Any]) -> None:
    for topic in bag["topics_with_message_count"]:
        if topic["topic_metadata"]["name"] == ODOM:
            topic["topic_metadata"]["type"] = "lab_msgs/msg/Odometer"


@pytest.mark.parametrize("storage", STORAGES)
def test_topics_of_other_programs_with_types_of_their_own_are_left_out(storage: str, tmp_path: Path) -> None:
    path = write_version(tmp_path / "bag", 9, storage, TOPICS, RECORDS)
    edit_metadata(path, other_package)
    bag = check_bag(path)
    assert bag.left_out == (ODOM,)
    assert ODOM not in bag.counts
    assert [record for record in RECORDS if record.name != ODOM] == list(bag.records)


def test_a_bag_of_nothing_but_such_topics_is_refused_by_name(tmp_path: Path) -> None:
    odom = {ODOM: TOPICS[ODOM]}
    path = write_version(tmp_path / "bag", 9, "mcap", odom, [r for r in RECORDS if r.name == ODOM])
    edit_metadata(path, other_package)
    with pytest.raises(BagError, match="holds no messages of a known type; left out: /odom"):
        check_bag(path)


def cut_short(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-5000])


def empty(path: Path) -> None:
    path.write_bytes(b"")


def scramble(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[100:4000] = bytes(255 - byte for byte in data[100:4000])
    path.write_bytes(data)


@pytest.mark.parametrize("storage", STORAGES)
@pytest.mark.parametrize("spoil", [cut_short, empty, scramble], ids=lambda spoil: spoil.__name__)
def test_damage_that_no_checksum_tells_is_found_all_the_same(
    spoil: Callable[[Path], None], storage: str, tmp_path: Path
) -> None:
    path = write_version(tmp_path / "bag", 9, storage, TOPICS, RECORDS)
    (data,) = (file for file in path.iterdir() if file.name != "metadata.yaml")
    spoil(data)
    with pytest.raises(BagError) as caught:
        check_bag(path)
    assert len(str(caught.value).splitlines()) == 1
