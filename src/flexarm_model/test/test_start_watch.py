"""A process that hangs while it starts ends with a code of its own and leaves its stacks behind."""

from __future__ import annotations

import subprocess
import sys
import textwrap

import pytest

from flexarm_model.process.start_watch import EXIT_STUCK

HOLDS_THE_LOCK = "ctypes.PyDLL(None).sleep(60)"  # of Python: no other thread and no handler runs
PROGRAM = """
import ctypes, time
from flexarm_model.process import start_watch
start_watch.WRITING = 0.2

def make_endpoint():
    {block}

watch = start_watch.StartWatch(0.3)
make_endpoint()
watch.end()
{after}
print("started")
"""


def run(block: str, after: str = "") -> subprocess.CompletedProcess[str]:
    program = PROGRAM.format(block=textwrap.indent(block, " " * 4).strip(), after=after)
    line = [sys.executable, "-c", program]
    return subprocess.run(line, capture_output=True, text=True, timeout=50, check=False)


@pytest.mark.parametrize("block", [HOLDS_THE_LOCK, "time.sleep(60)"])
def test_who_hangs_ends_and_says_where(block: str) -> None:
    ended = run(block)
    assert (ended.returncode, ended.stdout) == (EXIT_STUCK, "")
    assert "in make_endpoint" in ended.stderr


def test_who_has_started_may_take_his_time() -> None:
    ended = run("pass", "watch.end(); time.sleep(1.0)")
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "started\n", "")


def test_who_works_may_take_his_time() -> None:
    ended = run("end = time.process_time() + 1.0\nwhile time.process_time() < end: pass")
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "started\n", "")


def test_work_that_takes_long_by_its_nature_may() -> None:
    ended = run("with start_watch.takes_long(): time.sleep(1.0)")
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "started\n", "")


def test_after_such_work_the_clocks_run_again() -> None:
    ended = run("with start_watch.takes_long(): pass\ntime.sleep(60)")
    assert ended.returncode == EXIT_STUCK


def test_where_no_watch_runs_such_work_starts_none() -> None:
    ended = run("pass", "with start_watch.takes_long(): pass\ntime.sleep(1.0)")
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "started\n", "")
