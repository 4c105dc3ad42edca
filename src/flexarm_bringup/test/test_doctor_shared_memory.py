"""Segments of nodes that were killed are counted; never one whose node may live."""

from __future__ import annotations

import fcntl
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from flexarm_bringup.doctor import shared_memory
from flexarm_bringup.doctor.shared_memory import SHARED_MEMORY, look_at_shared_memory

DEAD, LIVING, YOUNG = (f"fastrtps_{digit * 16}" for digit in "0ab")
TALKER = """
import rclpy, sys
rclpy.init()
node = rclpy.create_node("talker")
print("ready", flush=True)
sys.stdin.read()
"""


def add_segment(folder: Path, name: str, age: float = 3600.0) -> Path:
    """Write a segment of 8 KB and its lock; return the lock."""
    (folder / name).write_bytes(b"x" * 8192)
    lock = folder / f"{name}_el"
    lock.touch()
    os.utime(lock, (time.time() - age,) * 2)
    return lock


def test_only_segments_whose_lock_nobody_holds_for_a_minute_are_counted(tmp_path: Path) -> None:
    add_segment(tmp_path, DEAD)
    add_segment(tmp_path, YOUNG, age=1.0)
    add_segment(tmp_path, "fastrtps_port7400")  # of a port: others may share it
    add_segment(tmp_path, "somebody_elses")
    (tmp_path / f"fastrtps_{'c' * 16}").write_bytes(b"x")  # without a lock nobody can tell
    with add_segment(tmp_path, LIVING).open("rb") as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        (found,) = look_at_shared_memory(tmp_path)
    assert (found.verdict, found.text) == ("hint", "1 segments of nodes that were killed, 0.0 MB")
    assert "fastdds shm clean" in found.cure
    (found,) = look_at_shared_memory(tmp_path)  # the other has ended, too
    assert found.text.startswith("2 segments")


def test_a_machine_without_such_a_folder_has_nothing_to_tell(tmp_path: Path) -> None:
    assert list(look_at_shared_memory(tmp_path / "nowhere")) == []
    (found,) = look_at_shared_memory(tmp_path)
    assert (found.verdict, found.cure) == ("ok", "")


@pytest.mark.ros
def test_a_node_that_lives_is_not_counted_and_one_that_was_killed_is(
    ros_environment: dict[str, str],
) -> None:
    """With Fast DDS as it comes: its own files, its own lock."""
    pytest.importorskip("rclpy", reason="needs ROS")
    if not SHARED_MEMORY.is_dir():
        pytest.skip("no shared memory here")
    own = {name: value for name, value in ros_environment.items() if "PROFILES" not in name}
    pipe = subprocess.PIPE
    talk = subprocess.Popen([sys.executable, "-c", TALKER], stdin=pipe, stdout=pipe, text=True, env=own)
    try:
        assert talk.stdout is not None and talk.stdout.readline() == "ready\n"
        locks = [os.readlink(link) for link in Path(f"/proc/{talk.pid}/fd").iterdir()]
        (lock,) = (Path(name) for name in locks if shared_memory._LOCK.fullmatch(Path(name).name))
        assert shared_memory._is_held(lock)  # this one alone: others may be about to lock theirs
    finally:
        talk.send_signal(signal.SIGKILL)
        talk.communicate()
    assert not shared_memory._is_held(lock)
    for path in (lock, lock.with_name(lock.name.removesuffix("_el"))):
        path.unlink()
