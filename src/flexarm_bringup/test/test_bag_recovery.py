"""A bag that was not closed gives back every message that reached the disk."""

from __future__ import annotations

import os
import resource
import struct
import zlib
from pathlib import Path

import pytest
from bag_fixture import PERIOD_NS, WRITTEN, joint_state, write_bag
from rosbag2_layout import qos, write_version

from flexarm_bringup import cli
from flexarm_bringup.bags.bag_reader import Record, check_bag
from flexarm_bringup.bags.bag_recovery import recover_bag
from flexarm_bringup.bags.bag_writer import CHECKSUM_FILE, DATA_FILE, ORIGIN_FILE, BagError, BagWriter
from flexarm_bringup.bags.mcap_records import CHUNK, MAGIC

JOINTS = "/flexarm/joint_states"
HEADER, CHUNK_HEADER = 9, 40  # bytes: of every record, and of a chunk without compression
SIZE = len(joint_state(0, 0.0)) + 31  # of a message with the header of its record


def broken_bag(path: Path, count: int) -> Path:
    """Write a bag and never close it."""
    writer = BagWriter(path, WRITTEN, {"preset": "geared"})
    for k in range(count):
        writer.write(JOINTS, k, joint_state(k, float(k)))
    writer.flush()
    return path


def test_what_was_flushed_is_recovered_byte_for_byte_with_its_origin_and_qos(tmp_path: Path) -> None:
    path = broken_bag(tmp_path / "bag", 3000)
    with pytest.raises(BagError, match="has no metadata.yaml"):
        check_bag(path)
    bag = recover_bag(path, tmp_path / "new").bag
    assert [record.cdr for record in bag.records] == [joint_state(k, float(k)) for k in range(3000)]
    assert bag.custom == {"preset": "geared"}
    sound = check_bag(write_bag(tmp_path / "sound"))
    assert bag.topics == sound.topics


def test_of_a_file_cut_anywhere_all_that_is_whole_is_recovered(tmp_path: Path) -> None:
    path = broken_bag(tmp_path / "bag", 3000)
    data = (path / DATA_FILE).read_bytes()
    for share in (0.4, 0.7, 0.9):
        (path / DATA_FILE).write_bytes(data[: int(share * len(data))])
        bag = recover_bag(path, tmp_path / f"new{share}").bag
        assert len(bag.records) >= 0.99 * share * 3000 - 1  # the rest is the index of chunks
        assert [record.log_time_ns for record in bag.records] == list(range(len(bag.records)))


def chunks(data: bytes) -> list[tuple[int, int]]:
    """Return where the chunks of a file begin, and how long each is with its header."""
    at, found = len(MAGIC), []
    while at + HEADER <= len(data):
        opcode, length = struct.unpack_from("<BQ", data, at)
        found += [(at, HEADER + length)] if opcode == CHUNK else []
        at += HEADER + length
    return found


def with_checksums(path: Path) -> bytearray:
    """Give every chunk of a data file its checksum, as rosbag2 does; return the file."""
    data = bytearray(path.read_bytes())
    for at, length in chunks(data):
        body = data[at + HEADER + CHUNK_HEADER : at + length]
        struct.pack_into("<I", data, at + HEADER + 24, zlib.crc32(body))
    path.write_bytes(data)
    return data


def test_a_file_that_ends_in_the_header_of_a_chunk_gives_all_before_it(tmp_path: Path) -> None:
    path = broken_bag(tmp_path / "bag", 1500)
    data = (path / DATA_FILE).read_bytes()
    at, _ = chunks(data)[-1]
    (path / DATA_FILE).write_bytes(data[:at])
    whole = recover_bag(path, tmp_path / "new").bag.records
    for cut in range(0, HEADER + CHUNK_HEADER, 4):
        (path / DATA_FILE).write_bytes(data[: at + cut])
        assert recover_bag(path, tmp_path / f"new{cut}").bag.records == whole


@pytest.mark.parametrize("is_closed", [False, True])
@pytest.mark.parametrize("which", [0, 1])
def test_a_chunk_that_was_changed_is_left_out_and_said(which: int, is_closed: bool, tmp_path: Path) -> None:
    path, count = tmp_path / "bag", 3000
    if is_closed:
        with BagWriter(path, WRITTEN, {}) as writer:
            for k in range(count):
                writer.write(JOINTS, k, joint_state(k, float(k)))
        (path / CHECKSUM_FILE).unlink()
    else:
        broken_bag(path, count)
    data = with_checksums(path / DATA_FILE)
    sound = recover_bag(path, tmp_path / "sound")
    assert (len(sound.bag.records), sound.doubts) == (count, ())
    at, length = chunks(data)[which]
    data[at + length - 20] ^= 0x10  # of the number in its last message
    (path / DATA_FILE).write_bytes(data)
    found = recover_bag(path, tmp_path / "new")
    doubt, *more = found.doubts
    assert len(more) == is_closed  # whose metadata tell how many there were
    assert doubt.startswith("the messages of 0.00000") and "left out: their chunk was changed" in doubt
    kept = {record.log_time_ns for record in found.bag.records}
    assert 0 < len(kept) < count
    assert all(record.cdr == joint_state(k := record.log_time_ns, float(k)) for record in found.bag.records)
    lost = sorted(set(range(count)) - kept)
    assert lost == list(range(lost[0], lost[-1] + 1)) and (lost[0] == 0) is (which == 0)


def test_a_chunk_that_is_cut_short_cannot_be_checked_and_is_read(tmp_path: Path) -> None:
    path = broken_bag(tmp_path / "bag", 3000)
    data = with_checksums(path / DATA_FILE)
    at, length = chunks(data)[-1]
    (path / DATA_FILE).write_bytes(data[: at + length // 2])
    found = recover_bag(path, tmp_path / "new")
    assert not found.doubts
    assert found.bag.records[-1].log_time_ns > len(recover_before(path, at, tmp_path / "before"))


def recover_before(path: Path, at: int, folder: Path) -> tuple[Record, ...]:
    """Return what is recovered of the first bytes of a bag's file."""
    (path / DATA_FILE).write_bytes((path / DATA_FILE).read_bytes()[:at])
    return recover_bag(path, folder).bag.records


def test_a_file_that_is_not_the_one_of_its_checksum_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write_bag(tmp_path / "bag")
    (path / "metadata.yaml").unlink()
    assert recover_bag(path, tmp_path / "sound").doubts == ()
    data = bytearray((path / DATA_FILE).read_bytes())
    data[data.index(joint_state(PERIOD_NS, 0.1)) + 50] ^= 0x10
    (path / DATA_FILE).write_bytes(data)
    assert cli.main(["recover", str(path), "--output", str(tmp_path / "new")]) == 1
    assert f"{DATA_FILE} is not what was recorded (SHA-256 differs)" in capsys.readouterr().out


def test_little_waits_in_memory(tmp_path: Path) -> None:
    path = tmp_path / "bag"
    writer = BagWriter(path, WRITTEN, {})
    for k in range(3000):
        writer.write(JOINTS, k, joint_state(k, 0.0))
        waiting = (k + 1) * SIZE - (path / DATA_FILE).stat().st_size
        assert waiting < 2**17 + 2 * SIZE
    writer.close()
    assert len(check_bag(path).records) == 3000


def test_a_closed_bag_keeps_no_trace_of_being_written(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "bag")
    assert sorted(os.listdir(path)) == sorted([DATA_FILE, CHECKSUM_FILE, "metadata.yaml"])
    assert not (path / ORIGIN_FILE).exists()


def test_a_bag_of_ros2_bag_record_is_recovered_too(tmp_path: Path) -> None:
    record = Record(JOINTS, "sensor_msgs/msg/JointState", PERIOD_NS, joint_state(PERIOD_NS, 0.1))
    topics = {JOINTS: (record.type, [qos("transient_local")])}
    path = write_version(tmp_path / "bag", 9, "mcap", topics, [record])
    (path / "metadata.yaml").unlink()
    bag = recover_bag(path, tmp_path / "new").bag
    assert bag.records == (record,)
    assert bag.topics[0].qos == (qos("transient_local"),)
    assert bag.custom == {}


def test_what_the_metadata_tell_of_and_is_not_there_is_told(tmp_path: Path) -> None:
    """Half a bag was recovered as if it were all of it."""
    records = [
        Record(JOINTS, "sensor_msgs/msg/JointState", k * PERIOD_NS, joint_state(k * PERIOD_NS, 0.1))
        for k in range(100)
    ]
    topics = {JOINTS: ("sensor_msgs/msg/JointState", [qos("transient_local")])}
    path = write_version(tmp_path / "bag", 9, "mcap", topics, records)
    assert not recover_bag(path, tmp_path / "whole").doubts
    (file,) = path.glob("*.mcap")
    data = file.read_bytes()
    file.write_bytes(data[: data.rindex(records[60].cdr)])
    recovered = recover_bag(path, tmp_path / "half")
    assert len(recovered.bag.records) == 60
    assert recovered.doubts == (
        "metadata.yaml tells of 100 messages: 40 are missing, damaged or of a type that is not known here",
    )
    for text in ("", "[]", "rosbag2_bagfile_information: {message_count: many}", "\t"):
        (path / "metadata.yaml").write_text(text)
        assert not recover_bag(path, tmp_path / f"half{len(text)}").doubts


def test_nothing_to_recover_ends_with_2_and_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    broken = tmp_path / "bag"
    broken.mkdir()
    for content, reason in (
        (None, "has 0 MCAP files"),
        (b"", "is empty: the recorder ended before anything was written"),
        (b"\x89MCAP0\r\n", "no whole"),
    ):
        if content is not None:
            (broken / DATA_FILE).write_bytes(content)
        assert cli.main(["recover", str(broken), "--output", str(tmp_path / "new")]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert reason in line
    assert not (tmp_path / "new").exists()


def test_the_command_says_what_it_recovered(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = broken_bag(tmp_path / "bag", 5)
    assert cli.main(["recover", str(path), "--output", str(tmp_path / "new")]) == 0
    assert "5 messages recovered" in capsys.readouterr().out


def test_of_a_disk_of_1_mb_nine_tenths_are_recovered_and_closing_does_no_harm(tmp_path: Path) -> None:
    path, taken = tmp_path / "bag", 0
    writer = BagWriter(path, WRITTEN, {})
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2**20, hard))
    try:
        with pytest.raises(OSError, match="too large"):
            for k in range(100_000):
                writer.write(JOINTS, k, joint_state(k, 0.0))
                taken = k + 1
        with pytest.raises(OSError, match="too large"):
            writer.close()
        writer.close()  # again, as at the end of a node
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert taken > 5000
    assert len(recover_bag(path, tmp_path / "new").bag.records) >= 0.9 * taken


@pytest.mark.parametrize("is_cut", [False, True])
def test_of_a_bag_that_was_closed_the_metadata_tell_with_what_it_was_recorded(
    is_cut: bool, tmp_path: Path
) -> None:
    """Its settings were looked for where a recorder keeps them only as long as it writes."""
    path = write_bag(tmp_path / "bag")
    custom = check_bag(path).custom
    assert custom
    if is_cut:
        os.truncate(path / DATA_FILE, (path / DATA_FILE).stat().st_size * 3 // 4)
    assert recover_bag(path, tmp_path / "new").bag.custom == custom
