"""Databases of rosbag2 that were changed, or do not hold all that was recorded, are refused in a line."""

from __future__ import annotations

import shutil
import sqlite3
from pathlib import Path

import numpy as np
import pytest
from bag_fixture import PERIOD_NS, joint_state
from rosbag2_layout import qos, write_version

from flexarm_bringup import cli
from flexarm_bringup.bags.bag_reader import Record, check_bag
from flexarm_bringup.bags.bag_writer import BagError

JOINTS = "/flexarm/joint_states"
KIND = "sensor_msgs/msg/JointState"
COUNT, FLIPS, SEED = 60, 100, 11
BEFORE = (
    12  # bytes of a row before its message: size, number, 6 of what it holds, time (SQLite's format, 2.1)
)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Return a bag whose messages take several pages."""
    stamps = [k * PERIOD_NS for k in range(1, COUNT + 1)]
    records = [Record(JOINTS, KIND, stamp_ns, joint_state(stamp_ns, 0.5)) for stamp_ns in stamps]
    return write_version(tmp_path / "bag", 9, "sqlite3", {JOINTS: (KIND, [qos()])}, records)


def database(path: Path) -> Path:
    (file,) = path.glob("*.db3")
    return file


def spoil_a_row(path: Path) -> None:
    """Let the row of a message be shorter than its parts: the file opens all the same."""
    data, message = bytearray(database(path).read_bytes()), joint_state(COUNT * PERIOD_NS, 0.5)
    at = data.index(message) - BEFORE
    assert data[at] == len(message) + BEFORE - 2  # bytes of the row, but for this number and the row's own
    data[at] ^= 2
    database(path).write_bytes(data)


@pytest.mark.parametrize("command", ["replay", "plot"])
def test_a_flipped_bit_in_a_message_ends_in_one_line(
    command: str, path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It was a traceback with the exit code of a divergence."""
    spoil_a_row(path)
    assert cli.main([command, str(path)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"flexarm {command}: {path}: ") and "malformed" in line


def test_any_flipped_bit_of_a_database_is_refused_or_does_no_harm(path: Path) -> None:
    sound, rng = database(path).read_bytes(), np.random.default_rng(SEED)
    refused = 0
    for _ in range(FLIPS):
        data = bytearray(sound)
        data[int(rng.integers(len(sound)))] ^= 1 << int(rng.integers(8))
        database(path).write_bytes(data)
        try:
            check_bag(path)
        except BagError as error:
            refused += 1
            assert len(str(error).splitlines()) == 1
    assert refused


@pytest.mark.parametrize(
    ("column", "value", "reason"),
    [
        ("timestamp", "'abc'", "a message on /flexarm/joint_states has the time 'abc'"),
        ("timestamp", "x'00ff'", r"has the time b'\x00\xff'"),
        ("timestamp", "1.5", "has the time 1.5"),
        ("data", "60", "a message on /flexarm/joint_states is 60"),
        ("data", "'text'", "is 'text'"),
    ],
)
def test_times_and_messages_of_another_kind_are_refused(
    column: str, value: str, reason: str, path: Path
) -> None:
    """A number of bytes was as many zeros, a text as a time a traceback, and 1.5 ns were a time."""
    with sqlite3.connect(database(path)) as base:
        base.execute(f"UPDATE messages SET {column} = {value} WHERE id = 30")
    base.close()
    with pytest.raises(BagError) as caught:
        check_bag(path)
    assert reason in str(caught.value)


def leave_a_log(path: Path, mode: str) -> sqlite3.Connection:
    """Change a message so that the change stands beside the database; return what keeps it there."""
    base = sqlite3.connect(database(path))
    base.execute(f"PRAGMA journal_mode = {mode}")
    base.execute("PRAGMA cache_size = 1")
    base.execute("UPDATE messages SET data = zeroblob(length(data))")
    if mode == "WAL":
        base.commit()
    return base


@pytest.mark.parametrize(("mode", "end"), [("WAL", "-wal"), ("DELETE", "-journal")])
def test_a_database_whose_log_lies_beside_it_is_refused_until_sqlite_has_opened_it(
    mode: str, end: str, path: Path, tmp_path: Path
) -> None:
    """What stood in the log was passed over: the bag that was read was not the one recorded."""
    base = leave_a_log(path, mode)
    killed = shutil.copytree(path, tmp_path / "killed")  # as whoever wrote it left it
    base.rollback()
    base.close()
    log = database(killed).with_name(database(killed).name + end)
    with pytest.raises(BagError) as caught:
        check_bag(killed)
    told = f"{killed}: {database(killed).name} is not all that was recorded, {log.name} belongs to it"
    assert str(caught.value).startswith(told)
    again = sqlite3.connect(database(killed))
    again.execute(str(caught.value).split("'")[1])  # what the text tells to do
    again.close()
    assert not log.exists()
    if mode == "DELETE":  # of a change that was never finished nothing is left
        assert len(check_bag(killed).records) == COUNT
    else:
        with pytest.raises(BagError, match="does not decode"):
            check_bag(killed)


def test_an_empty_log_or_one_that_is_done_with_does_no_harm(path: Path) -> None:
    """SQLite leaves them, when told to keep its files."""
    Path(f"{database(path)}-wal").touch()
    Path(f"{database(path)}-journal").write_bytes(bytes(512))  # PERSIST: a header of zeros
    assert len(check_bag(path).records) == COUNT
