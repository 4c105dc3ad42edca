"""Who leaves a library that never lets go ends in time, with the exit code of what it has done."""

from __future__ import annotations

import subprocess
import sys
import time

import pytest

from flexarm_model.process.leaving import end_within, ends_within

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


def test_who_has_nothing_left_to_do_is_ended_while_python_ends() -> None:
    program = (
        "import atexit, ctypes\n"
        "from flexarm_model.process.leaving import end_within\n"
        "print('done', end='')\n"
        "end_within(0.2, 7)\n"
        f"atexit.register(lambda: {HOLDS_THE_LOCK})\n"
    )
    line = [sys.executable, "-c", program]
    ended = subprocess.run(line, capture_output=True, text=True, timeout=50, check=False)
    assert (ended.returncode, ended.stdout, ended.stderr) == (7, "done", "")


def test_who_takes_it_back_goes_on() -> None:
    end_within(0.05, 3)()
    time.sleep(0.2)


def test_the_time_is_over_with_the_block() -> None:
    with pytest.raises(ZeroDivisionError), ends_within(0.05, 3):
        raise ZeroDivisionError
    time.sleep(0.2)  # and this process still runs
