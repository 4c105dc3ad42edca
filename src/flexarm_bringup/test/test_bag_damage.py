"""Bags of other programs: split over files, compressed and damaged, with metadata that are wrong."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest
from bag_fixture import PERIOD_NS, joint_state, write_bag
from rosbag2_layout import edit_metadata, qos, write_version
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

from flexarm_bringup import cli
from flexarm_bringup.bags.bag_reader import Record, check_bag, decode
from flexarm_bringup.bags.bag_recovery import recover_bag
from flexarm_bringup.bags.bag_types import bag_types
from flexarm_bringup.bags.bag_writer import CHECKSUM_FILE, DATA_FILE, BagError
from flexarm_bringup.bags.packed_message import zstd

JOINTS = "/flexarm/joint_states"
KIND = "sensor_msgs/msg/JointState"
ZSTD = b"\x28\xb5\x2f\xfd"  # the first bytes of compressed data


def records(count: int) -> list[Record]:
    return [Record(JOINTS, KIND, k * PERIOD_NS, joint_state(k * PERIOD_NS, 0.1 * k)) for k in range(count)]


def write_split(folder: Path, parts: Sequence[Sequence[Record]]) -> Path:
    """Write a bag whose metadata list one file per part, in that order."""
    names, files, start = [], [], min(record.log_time_ns for part in parts for record in part)
    for i, part in enumerate(parts):
        one = write_version(folder.with_name(f"part_{i}"), 9, "mcap", {JOINTS: (KIND, [qos()])}, part)
        if i == 0:
            shutil.copytree(one, folder)
            (folder / "part_0.mcap").unlink()
        names.append(shutil.copy(one / f"part_{i}.mcap", folder / f"part_{i}.mcap").name)
        edit_metadata(one, lambda bag: files.extend(bag["files"]))

    def list_all(bag: dict[str, Any]) -> None:
        bag["relative_file_paths"], bag["message_count"] = names, sum(map(len, parts))
        bag["files"] = files
        bag["topics_with_message_count"][0]["message_count"] = sum(map(len, parts))
        bag["starting_time"]["nanoseconds_since_epoch"] = start

    edit_metadata(folder, list_all)
    return folder


@pytest.mark.parametrize("order", ["one after the other", "swapped", "overlapping"])
def test_records_of_split_bags_are_in_order_of_their_log_times(order: str, tmp_path: Path) -> None:
    whole = records(20)
    parts = {
        "one after the other": [whole[:10], whole[10:]],
        "swapped": [whole[10:], whole[:10]],
        "overlapping": [whole[:8] + whole[8:14:2], whole[9:14:2] + whole[14:]],
    }[order]
    assert list(check_bag(write_split(tmp_path / "bag", parts)).records) == whole


def test_an_instant_that_two_files_share_keeps_the_order_of_the_files_in_time(tmp_path: Path) -> None:
    first = [*records(2), *(Record(JOINTS, KIND, PERIOD_NS, joint_state(PERIOD_NS, p)) for p in (0.2, 0.3))]
    for k, parts in enumerate([[first[:3], first[3:]], [first[3:], first[:3]]]):
        found = check_bag(write_split(tmp_path / str(k) / "bag", parts)).records
        assert [decode(record).position[0] for record in found] == [0.0, 0.1, 0.2, 0.3]


def write_compressed(folder: Path, storage: StoragePlugin, mode: CompressionMode) -> Path:
    """Write a bag of 200 messages; return its data file."""
    writer = Writer(folder, version=9, storage_plugin=storage)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        connection = writer.add_connection(JOINTS, KIND, typestore=bag_types(), offered_qos_profiles=[qos()])
        for record in records(200):
            writer.write(connection, record.log_time_ns, record.cdr)
    (data,) = (path for path in folder.iterdir() if path.name != "metadata.yaml")
    return data


COMPRESSED = [
    (StoragePlugin.SQLITE3, CompressionMode.FILE),
    (StoragePlugin.MCAP, CompressionMode.FILE),
    (StoragePlugin.MCAP, CompressionMode.MESSAGE),
    (StoragePlugin.MCAP, CompressionMode.STORAGE),
]


@pytest.mark.parametrize(("storage", "mode"), COMPRESSED, ids=lambda item: item.name.lower())
def test_compressed_bags_that_are_damaged_are_refused_with_one_line(
    storage: StoragePlugin, mode: CompressionMode, tmp_path: Path
) -> None:
    data = write_compressed(tmp_path / "bag", storage, mode)
    assert len(check_bag(tmp_path / "bag").records) == 200
    good = data.read_bytes()
    at = good.index(ZSTD)
    for end in (at + 4, at + 40):  # inverted: what marks the frame, and the beginning of its content
        data.write_bytes(good[:at] + bytes(255 - byte for byte in good[at:end]) + good[end:])
        with pytest.raises(BagError) as caught:
            check_bag(tmp_path / "bag")
        assert len(str(caught.value).splitlines()) == 1


def test_messages_that_were_compressed_one_by_one_are_recovered_as_they_were(tmp_path: Path) -> None:
    """All of a sound bag were said to be undecodable."""
    data = write_compressed(tmp_path / "bag", StoragePlugin.MCAP, CompressionMode.MESSAGE)
    found = recover_bag(tmp_path / "bag", tmp_path / "new")
    assert (list(found.bag.records), found.doubts) == (records(200), ())
    assert list(check_bag(tmp_path / "new").records) == records(200)
    (tmp_path / "bag" / "metadata.yaml").unlink()
    content = data.read_bytes()
    at = content.index(ZSTD) + len(ZSTD)
    data.write_bytes(content[:at] + bytes(255 - byte for byte in content[at : at + 4]) + content[at + 4 :])
    found = recover_bag(tmp_path / "bag", tmp_path / "rest")
    assert list(found.bag.records) == records(200)[1:]
    assert found.doubts[0].startswith("messages left out that cannot be decoded: 1,")


def test_what_to_do_with_a_file_that_is_compressed_as_a_whole_is_said(tmp_path: Path) -> None:
    """There was no MCAP file, it said."""
    data = write_compressed(tmp_path / "bag", StoragePlugin.MCAP, CompressionMode.FILE)
    with pytest.raises(BagError, match=r"compressed as whole files: bag.mcap.zstd; unpack each with zstd -d"):
        recover_bag(tmp_path / "bag", tmp_path / "new")
    data.with_suffix("").write_bytes(zstd.decompress(data.read_bytes()))
    found = recover_bag(tmp_path / "bag", tmp_path / "new")
    assert (list(found.bag.records), found.doubts) == (records(200), ())


def test_data_that_are_not_compressed_as_the_metadata_say_are_refused(tmp_path: Path) -> None:
    path = write_version(tmp_path / "bag", 9, "mcap", {JOINTS: (KIND, [qos()])}, records(3))
    edit_metadata(path, lambda bag: bag.update(compression_mode="MESSAGE", compression_format="zstd"))
    with pytest.raises(BagError, match="data are cut short or changed"):
        check_bag(path)


def of_topic(**values: Any) -> Callable[[dict[str, Any]], None]:
    def edit(bag: dict[str, Any]) -> None:
        topic = bag["topics_with_message_count"][0]
        for key, value in values.items():
            (topic if key in topic else topic["topic_metadata"])[key] = value

    return edit


def custom(value: Any) -> Callable[[dict[str, Any]], None]:
    return lambda bag: bag.update(custom_data=value)


WRONG: dict[str, tuple[Callable[[dict[str, Any]], None], str]] = {
    "count of a text": (of_topic(message_count="two"), "has 'two' messages"),
    "no count": (of_topic(message_count=None), "has None messages"),
    "count with a point": (of_topic(message_count=2.0), "has 2.0 messages"),
    "no name": (of_topic(name=None), "a topic None"),
    "no type": (of_topic(type=None), "of type None"),
    "name that clears the screen": (of_topic(name="/a\x1b[2J"), r"a topic '/a\x1b[2J'"),
    "type in two lines": (of_topic(type="lab_msgs/msg/A\nB"), r"of type 'lab_msgs/msg/A\nB'"),
    "custom list": (custom([1, 2]), "custom_data are not values by name, but list"),
    "custom text": (custom("abc"), "custom_data are not values by name, but str"),
}


@pytest.mark.parametrize("name", WRONG)
def test_metadata_of_another_kind_are_refused_with_one_line(name: str, tmp_path: Path) -> None:
    edit, reason = WRONG[name]
    path = write_bag(tmp_path / "bag")
    edit_metadata(path, edit)
    with pytest.raises(BagError) as caught:
        check_bag(path)
    assert str(caught.value).startswith(f"{path}: metadata are wrong: ")
    assert reason in str(caught.value) and len(str(caught.value).splitlines()) == 1


def test_metadata_nested_without_end_are_refused(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "bag")
    (path / "metadata.yaml").write_text("[" * 5000)
    with pytest.raises(BagError, match="cannot be opened"):
        check_bag(path)


def test_custom_data_that_look_like_numbers_are_texts(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "bag")
    edit_metadata(path, custom({"run": 7, 3: None}))
    assert check_bag(path).custom == {"run": "7", "3": ""}


def test_a_checksum_is_told_where_there_is_one_and_a_strangers_is_left_alone(tmp_path: Path) -> None:
    assert check_bag(write_bag(tmp_path / "ours")).has_checksum
    path = write_version(tmp_path / "theirs", 9, "mcap", {JOINTS: (KIND, [qos()])}, records(3))
    (path / CHECKSUM_FILE).write_text(f"{'0' * 64}  theirs.mcap\n")
    assert not check_bag(path).has_checksum


def test_a_bag_without_metadata_can_be_recovered_and_says_how(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "bag")
    (path / "metadata.yaml").unlink()
    with pytest.raises(BagError, match=f"has no metadata.yaml .*`flexarm recover {path} --output DIR`"):
        check_bag(path)


@pytest.mark.parametrize("command", ["replay", "plot"])
@pytest.mark.parametrize(
    ("method", "name"),
    [("is_file", "metadata.yaml"), ("read_bytes", DATA_FILE), ("read_text", CHECKSUM_FILE)],
)
def test_a_bag_that_may_not_be_read_is_refused_in_one_line(
    command: str,
    method: str,
    name: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path, allowed = write_bag(tmp_path / "bag"), getattr(Path, method)

    def refuse(self: Path, *args: Any, **options: Any) -> Any:
        if self == path / name:
            raise PermissionError(13, "Permission denied", str(self))
        return allowed(self, *args, **options)

    monkeypatch.setattr(Path, method, refuse)  # root may read everything
    assert cli.main([command, str(path)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"flexarm {command}: {path}: cannot be read: ") and str(path / name) in line


def test_a_name_that_no_folder_can_have_is_refused(tmp_path: Path) -> None:
    path = tmp_path / ("x" * 300)
    with pytest.raises(BagError, match=f"^{path}: "):
        check_bag(path)
