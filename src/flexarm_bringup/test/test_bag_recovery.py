"""A bag that was not closed gives back every message that reached the disk."""

from __future__ import annotations

import os
import resource
from pathlib import Path

import pytest
from bag_fixture import PERIOD_NS, WRITTEN, joint_state, write_bag
from rosbag2_layout import qos, write_version

from flexarm_bringup import cli
from flexarm_bringup.bags.bag_reader import Record, check_bag
from flexarm_bringup.bags.bag_recovery import recover_bag
from flexarm_bringup.bags.bag_writer import CHECKSUM_FILE, DATA_FILE, ORIGIN_FILE, BagError, BagWriter

JOINTS = "/flexarm/joint_states"
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
    bag = recover_bag(path, tmp_path / "new")
    assert [record.cdr for record in bag.records] == [joint_state(k, float(k)) for k in range(3000)]
    assert bag.custom == {"preset": "geared"}
    sound = check_bag(write_bag(tmp_path / "sound"))
    assert bag.topics == sound.topics


def test_of_a_file_cut_anywhere_all_that_is_whole_is_recovered(tmp_path: Path) -> None:
    path = broken_bag(tmp_path / "bag", 3000)
    data = (path / DATA_FILE).read_bytes()
    for share in (0.4, 0.7, 0.9):
        (path / DATA_FILE).write_bytes(data[: int(share * len(data))])
        bag = recover_bag(path, tmp_path / f"new{share}")
        assert len(bag.records) >= 0.99 * share * 3000 - 1  # the rest is the index of chunks
        assert [record.log_time_ns for record in bag.records] == list(range(len(bag.records)))


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
    bag = recover_bag(path, tmp_path / "new")
    assert bag.records == (record,)
    assert bag.topics[0].qos == (qos("transient_local"),)
    assert bag.custom == {}


def test_nothing_to_recover_ends_with_2_and_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    broken = tmp_path / "bag"
    broken.mkdir()
    for content, reason in (
        (None, "has 0 MCAP files"),
        (b"", "is not an MCAP"),
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
    assert len(recover_bag(path, tmp_path / "new").records) >= 0.9 * taken
