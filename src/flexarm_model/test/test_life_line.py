"""A line to who started a process is let go of when it ends, not before and not later."""

import os
import select
import signal
import socket
import subprocess
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path

import pytest

from flexarm_model.process.life_line import MARK, take_line

HOLDS = textwrap.dedent("""
    import ctypes, os, sys, time
    from flexarm_model.process import life_line
    {before}
    life_line.hold_until_the_end(life_line.take_line())
    print("holds", os.environ.get(life_line.MARK), repr(sys.stdin.read()), flush=True)
    time.sleep(60)
""")
NO_LINUX = "del ctypes.CDLL; ctypes.CDLL = lambda name: object()"


@pytest.fixture
def line() -> Iterator[tuple[socket.socket, socket.socket]]:
    ours, theirs = socket.socketpair()
    with ours, theirs:
        yield ours, theirs


def start(theirs: socket.socket, program: str) -> subprocess.Popen[str]:
    child = subprocess.Popen(
        [sys.executable, "-c", program],
        env={**os.environ, MARK: "1", "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        stdin=theirs.fileno(), stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    theirs.close()
    assert child.stdout is not None
    assert child.stdout.readline() == "holds None ''\n"  # nobody else takes it for his, or reads from it
    return child


def has_ended(ours: socket.socket, seconds: float) -> bool:
    readable, _, _ = select.select([ours], [], [], seconds)
    return bool(readable) and ours.recv(1) == b""


@pytest.mark.parametrize("before", ["", NO_LINUX])
def test_a_line_is_let_go_of_when_the_process_is_killed_and_not_before(
    line: tuple[socket.socket, socket.socket], before: str
) -> None:
    ours, theirs = line
    child = start(theirs, HOLDS.format(before=before))
    assert not has_ended(ours, 0.1)
    os.kill(child.pid, signal.SIGKILL)
    assert has_ended(ours, 20.0)
    child.wait()


def test_one_thread_alone_holds_the_line(line: tuple[socket.socket, socket.socket]) -> None:
    """Were it a file of the whole process, it would be closed only when its last thread has ended."""
    ours, theirs = line
    child = start(theirs, HOLDS.format(before=""))
    tables: dict[str, list[str]] = {
        thread.name: [os.readlink(each) for each in (thread / "fd").iterdir()]
        for thread in Path(f"/proc/{child.pid}/task").iterdir()
    }
    main = tables.pop(str(child.pid))
    (held,) = (table for table in tables.values() if table != main)
    child.kill()
    child.wait()
    assert len(held) == 1 and held[0].startswith("socket:")
    assert not set(held) & set(main)


def test_who_was_started_by_hand_keeps_his_standard_input() -> None:
    assert take_line({}) is None
