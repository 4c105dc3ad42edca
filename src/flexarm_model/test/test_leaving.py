"""Who leaves a library that never lets go ends in time, with the exit code of what it has done."""

from __future__ import annotations

import subprocess
import sys
import time

import pytest

from flexarm_model.process.leaving import ends_within

PROGRAM = """
import ctypes, time
from flexarm_model.process.leaving import ends_within
print("done", end="")  # a pipe: nobody would see it if it was not flushed
with ends_within(0.2, {code}):
    {block}
print(", and left")
raise SystemExit(9)
"""
HOLDS_THE_LOCK = "ctypes.PyDLL(None).sleep(60)"  # of Python: no other thread and no handler runs


def run(code: int, block: str) -> subprocess.CompletedProcess[str]:
    line = [sys.executable, "-c", PROGRAM.format(code=code, block=block)]
    return subprocess.run(line, capture_output=True, text=True, timeout=50, check=False)


@pytest.mark.parametrize("code", [0, 1, 130])
def test_who_is_held_up_ends_with_his_code(code: int) -> None:
    ended = run(code, HOLDS_THE_LOCK)
    assert (ended.returncode, ended.stdout, ended.stderr) == (code, "done", "")


def test_who_leaves_in_time_goes_on() -> None:
    ended = run(0, "pass")
    assert (ended.returncode, ended.stdout) == (9, "done, and left\n")


def test_the_time_is_over_with_the_block() -> None:
    with pytest.raises(ZeroDivisionError), ends_within(0.05, 3):
        raise ZeroDivisionError
    time.sleep(0.2)  # and this process still runs
