"""What killed nodes left in shared memory: Fast DDS removes a segment when its node ends by itself only.

A node that lives holds a lock (flock(2)) on the file ``_el`` beside its segment. Whether one is held is told
by the kernel in every container that sees the file, whatever processes it sees. Files that are younger than
a minute are left alone: who has just made one may be about to lock it.
"""

from __future__ import annotations

import fcntl
import os
import re
import time
from collections.abc import Iterator
from pathlib import Path

from flexarm_bringup.doctor.finding import Finding

SHARED_MEMORY = Path("/dev/shm")  # noqa: S108 - that is where Fast DDS has its segments
SETTLED = 60.0  # s
_LOCK = re.compile(r"(fastrtps|fastdds)_[0-9a-f]{16}_el")
_BLOCK = 512  # bytes of st_blocks
CURE = (
    "fastdds shm clean; without that tool, when no ROS node runs on this machine: "
    "rm /dev/shm/fastrtps_* /dev/shm/sem.fastrtps_*"
)


def look_at_shared_memory(folder: Path = SHARED_MEMORY) -> Iterator[Finding]:
    """Yield what nodes left that are gone; nothing where there is no such folder."""
    if not folder.is_dir():
        return
    sizes = [sum(map(_size, (segment, lock))) for segment, lock in _abandoned(folder)]
    if not sizes:
        yield Finding("ok", "shared memory", "no segments of nodes that are gone")
        return
    text = f"{len(sizes)} segments of nodes that were killed, {sum(sizes) / 1e6:.1f} MB"
    yield Finding("hint", "shared memory", text, CURE)


def _abandoned(folder: Path) -> Iterator[tuple[Path, Path]]:
    """Yield every segment whose node is gone for certain, with its lock."""
    for lock in sorted(folder.iterdir()):
        if _LOCK.fullmatch(lock.name) and _is_settled(lock) and not _is_held(lock):
            yield lock.with_name(lock.name.removesuffix("_el")), lock


def _is_settled(path: Path) -> bool:
    try:
        return time.time() - path.stat().st_mtime > SETTLED
    except OSError:  # gone meanwhile
        return False


def _is_held(path: Path) -> bool:
    """Return whether a process holds the lock of a file, or nobody can tell."""
    try:
        descriptor = os.open(path, os.O_RDONLY)
    except OSError:  # somebody else's, or gone meanwhile
        return True
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except OSError:
        return True
    finally:
        os.close(descriptor)
    return False


def _size(path: Path) -> int:
    """Return what a file takes [byte]; 0 when it is gone."""
    try:
        return path.stat().st_blocks * _BLOCK
    except OSError:
        return 0
