"""A good bag is read as written; a bad one is refused with one line that says why."""

import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from bag_fixture import PERIOD_NS, WRITTEN, joint_state, write_bag
from rosbags.rosbag2 import Reader

from flexarm_bringup.bags.bag_reader import check_bag, decode
from flexarm_bringup.bags.bag_types import bag_types
from flexarm_bringup.bags.bag_writer import CHECKSUM_FILE, DATA_FILE, BagError, BagWriter
from flexarm_bringup.topics import STREAMS, Stream, find_stream, streams

JOINTS, MODAL = "/flexarm/joint_states", "/flexarm/modal_state"


def test_what_was_written_is_read_back_byte_for_byte(tmp_path: Path) -> None:
    bag = check_bag(write_bag(tmp_path / "bag"), [JOINTS, MODAL])
    assert dict(bag.counts) == {JOINTS: 2, MODAL: 2, "/flexarm/model": 0}
    assert bag.custom == {"git": "0" * 40}
    assert [record.log_time_ns for record in bag.records] == [0, 0, PERIOD_NS, PERIOD_NS]
    assert bag.records[2].cdr == joint_state(PERIOD_NS, 0.1)
    assert decode(bag.records[2]).position[0] == 0.1


def test_identical_input_gives_identical_files_whatever_the_folder(tmp_path: Path) -> None:
    first, second = write_bag(tmp_path / "one"), write_bag(tmp_path / "two")
    names = sorted(path.name for path in first.iterdir())
    assert names == sorted(path.name for path in second.iterdir())
    assert all((first / name).read_bytes() == (second / name).read_bytes() for name in names)


def test_order_of_writing_is_kept_among_equal_stamps_across_chunks(tmp_path: Path) -> None:
    count = 12_000  # 1.3 MB: more than one chunk of the data file
    with BagWriter(tmp_path / "bag", WRITTEN, {}) as writer:
        for k in range(count):
            writer.write(JOINTS, 0, joint_state(k, float(k)))
    bag = check_bag(tmp_path / "bag")
    assert (tmp_path / "bag" / DATA_FILE).stat().st_size > 2**20
    assert [decode(record).position[0] for record in bag.records] == list(range(count))


def test_latched_topics_offer_transient_local_durability(tmp_path: Path) -> None:
    with Reader(write_bag(tmp_path / "bag")) as reader:
        offered = {c.topic: c.ext.offered_qos_profiles[0].durability.name for c in reader.connections}
    assert offered == {JOINTS: "VOLATILE", MODAL: "VOLATILE", "/flexarm/model": "TRANSIENT_LOCAL"}


def test_a_bag_is_closed_when_its_writer_is_interrupted(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt), BagWriter(tmp_path / "bag", WRITTEN, {}) as writer:
        writer.write(JOINTS, 0, joint_state(0, 0.0))
        raise KeyboardInterrupt
    assert check_bag(tmp_path / "bag").counts[JOINTS] == 1


def test_an_existing_bag_is_not_overwritten(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="exists already"):
        BagWriter(write_bag(tmp_path / "bag"), WRITTEN, {})


def edit(path: Path, old: bytes, new: bytes) -> None:
    content = path.read_bytes()
    assert old in content
    path.write_bytes(content.replace(old, new))


def forget_checksum(path: Path) -> None:
    (path / CHECKSUM_FILE).unlink()


def truncate(path: Path) -> None:
    data = path / DATA_FILE
    data.write_bytes(data.read_bytes()[:-700])


def truncate_unchecked(path: Path) -> None:
    forget_checksum(path)
    truncate(path)


def empty_unchecked(path: Path) -> None:
    forget_checksum(path)
    (path / DATA_FILE).write_bytes(b"")


def flip_a_byte(path: Path) -> None:
    edit(path / DATA_FILE, struct.pack("<d", 0.1), struct.pack("<d", 0.2))


def flip_a_length(path: Path) -> None:
    forget_checksum(path)
    edit(path / DATA_FILE, b"\x08\x00\x00\x00base.rz\x00", b"\xff\x7f\x00\x00base.rz\x00")


def rename_type(path: Path) -> None:
    for name in ("metadata.yaml", DATA_FILE):
        edit(path / name, b"flexarm_interfaces/msg/ModalState", b"flexarm_interfaces/msg/ModelState")
    forget_checksum(path)


def other_definition(path: Path) -> None:
    digest = bag_types().hash_rihs01("sensor_msgs/msg/JointState").encode()
    edit(path / "metadata.yaml", digest, digest[:-4] + b"0000")


def text(old: str, new: str) -> Callable[[Path], None]:
    return lambda path: edit(path / "metadata.yaml", old.encode(), new.encode())


BAD_BAGS: dict[str, tuple[Callable[[Path], object], str]] = {
    "metadata missing": (lambda path: (path / "metadata.yaml").unlink(), "has no metadata.yaml"),
    "metadata empty": (lambda path: (path / "metadata.yaml").write_text(""), "cannot be opened"),
    "metadata not YAML": (lambda path: (path / "metadata.yaml").write_text("a: [1"), "cannot be opened"),
    "metadata binary": (lambda path: (path / "metadata.yaml").write_bytes(b"\xff"), "cannot be opened"),
    "metadata key missing": (text("storage_identifier", "storage"), "metadata key is missing"),
    "metadata of the future": (text("version: 9", "version: 10"), "version 10 not supported"),
    "data file missing": (lambda path: (path / DATA_FILE).unlink(), "is missing"),
    "data file empty": (lambda path: (path / DATA_FILE).write_bytes(b""), "is empty"),
    "data file empty, unchecked": (empty_unchecked, "cannot be opened"),
    "data file cut short": (truncate, "SHA-256 differs"),
    "data file cut short, unchecked": (truncate_unchecked, "cannot be opened"),
    "byte flipped": (flip_a_byte, "SHA-256 differs"),
    "length flipped": (flip_a_length, "does not decode as sensor_msgs/msg/JointState"),
    "unknown type": (rename_type, "has type flexarm_interfaces/msg/ModelState"),
    "other definition": (other_definition, "another definition of sensor_msgs/msg/JointState"),
    "count too high": (text("message_count: 2", "message_count: 3"), "has 2 messages, its metadata say 3"),
    "topic renamed": (text("name: /flexarm/joint_states", "name: /flexarm/joint_stats"), "has 0 messages"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD_BAGS)
def test_a_bad_bag_is_refused_with_one_line(name: str, tmp_path: Path) -> None:
    spoil, reason = BAD_BAGS[name]
    path = write_bag(tmp_path / "bag")
    spoil(path)
    with pytest.raises(BagError) as caught:
        check_bag(path, [JOINTS])
    assert reason in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


def test_a_folder_that_is_no_bag_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="no such folder"):
        check_bag(tmp_path / "missing")
    (tmp_path / "file").write_text("")
    with pytest.raises(BagError, match="is a file"):
        check_bag(tmp_path / "file")


def test_a_bag_without_messages_never_passes(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="holds no messages"):
        check_bag(write_bag(tmp_path / "bag", ticks=0))


def test_a_missing_topic_is_named_with_those_there_are(tmp_path: Path) -> None:
    with pytest.raises(BagError, match=f"no message on /flexarm/model; it has {JOINTS}, {MODAL}"):
        check_bag(write_bag(tmp_path / "bag"), ["/flexarm/model"])


def test_an_unknown_type_on_a_foreign_topic_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "bag"
    with BagWriter(path, [Stream("/x", "std_msgs/msg/String", "user", "event", "")], {}) as writer:
        writer.write("/x", 0, b"\x00\x01\x00\x00\x01\x00\x00\x00\x00")
    for name in ("metadata.yaml", DATA_FILE):
        edit(path / name, b"std_msgs/msg/String", b"std_msgs/msg/Strong")
    forget_checksum(path)
    with pytest.raises(BagError, match="unknown type std_msgs/msg/Strong"):
        check_bag(path)


def test_every_type_of_the_table_is_known() -> None:
    assert all(stream.type in bag_types().types for stream in STREAMS)


def test_the_family_of_accelerometers_is_written_out() -> None:
    written = streams(["tip_accelerometer", "hub"])
    names = [stream.name for stream in written if stream.type == "sensor_msgs/msg/Imu"]
    assert names == ["/flexarm/imu/tip_accelerometer", "/flexarm/imu/hub"]
    for name in names:
        found = find_stream(name)
        assert found is not None
        assert found.name == name
    assert find_stream("/flexarm/imu/") is None
    assert find_stream("/rosout") is None


@pytest.mark.parametrize("name", ["metadata.yaml", pytest.param(DATA_FILE, marks=pytest.mark.slow)])
def test_no_damage_raises_anything_but_a_bag_error(name: str, tmp_path: Path) -> None:
    path = write_bag(tmp_path / "bag")
    forget_checksum(path)
    good = (path / name).read_bytes()
    rng = np.random.default_rng(48)
    refused = 0
    for k in range(300):
        spoiled = bytearray(good)
        at = rng.integers(0, len(good), size=1 + k % 8)
        for i in at:
            spoiled[i] = rng.integers(0, 256)
        (path / name).write_bytes(spoiled[: at[0]] if k % 3 == 0 else spoiled)
        try:
            check_bag(path, [JOINTS])
        except BagError as error:
            refused += 1
            assert len(str(error).splitlines()) == 1
    assert refused > 100  # every third is cut short
