"""Work beside a loop: the same at once and in another process, in order, dropped with a reason."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from flexarm_model.process.beside import Beside, Thoughts, WorkLost, at_once

PATIENCE = 60.0  # s


class Dropped(Exception):
    """Why work comes to nothing."""


def broken() -> Callable[[Any], Any]:
    """Make nothing."""
    raise ValueError("cannot be made")


def made(factor: int) -> Callable[[Any], Any]:
    """Make what does tasks: it multiplies numbers, waits, tells who does it, or ends."""

    def work(task: Any) -> Any:
        """Do one."""
        if isinstance(task, float):
            time.sleep(task)
        if task == "who":
            return os.getpid()
        if task == "how":
            return os.sched_getscheduler(0) == os.SCHED_OTHER, sorted(os.sched_getaffinity(0))
        if task == "print":
            print("this goes where errors go", flush=True)
        if task == "end":
            os._exit(3)
        return factor * len(task) if isinstance(task, bytes) else factor * task

    return work


def thinking(*tasks: Any) -> Thoughts[tuple[list[Any], str]]:
    """Collect what work makes of tasks; tells what went wrong."""
    found = []
    for task in tasks:
        try:
            found.append((yield task))
        except (Dropped, WorkLost) as why:
            return found, str(why)
    return found, ""


@pytest.fixture
def beside() -> Iterator[Beside]:
    """Give one that ends with the test."""
    begun = Beside("test worker", made, 2)
    yield begun
    begun.end()


def look(beside: Beside) -> float:
    """Look until nothing is under way; returns the longest that a look took [s]."""
    longest, end = 0.0, time.monotonic() + PATIENCE
    while beside.is_busy and time.monotonic() < end:
        began = time.monotonic()
        beside.look()
        longest = max(longest, time.monotonic() - began)
        time.sleep(0.002)
    assert not beside.is_busy
    return longest


def test_thoughts_come_to_the_same_at_once_and_beside_the_loop(beside: Beside) -> None:
    found: list[Any] = []
    assert at_once(thinking(1, 2, 3), made(2)) == ([2, 4, 6], "")
    beside.begin(thinking(1, 2, 3), found.append)
    beside.begin(thinking(4), found.append)
    assert not found
    look(beside)
    assert sorted(found) == [([2, 4, 6], ""), ([8], "")]
    assert at_once(thinking(), made(2)) == ([], "")


def test_tasks_are_done_by_one_other_process_in_the_order_in_which_they_came(beside: Beside) -> None:
    found: list[Any] = []
    for task in (0.05, 1, "who", 2, "who"):
        beside.begin(thinking(task), found.append)
    look(beside)
    results = [result for ([result], _) in found]
    assert results[:2] == [0.1, 2] and results[3] == 4
    assert results[2] == results[4] != os.getpid()


def test_thoughts_begin_when_there_is_somebody_to_work(beside: Beside) -> None:
    """What they begin with must not grow old while the process is made."""
    begun: list[float] = []

    def late() -> Thoughts[Any]:
        """Note when it begins."""
        begun.append(time.monotonic())
        return (yield 1)

    found: list[Any] = []
    beside.begin(late(), found.append)
    assert not begun and beside.is_busy
    look(beside)
    assert found == [2] and time.monotonic() - begun[0] < 1.0


def test_thoughts_without_a_task_come_to_an_end(beside: Beside) -> None:
    found: list[Any] = []
    for tasks in ((), (1,), ()):
        beside.begin(thinking(*tasks), found.append)
    look(beside)
    assert sorted(found) == [([], ""), ([], ""), ([2], "")]


def test_a_task_that_is_larger_than_a_pipe_is_sent_bit_by_bit(beside: Beside) -> None:
    found: list[Any] = []
    beside.begin(thinking(0.3, bytes(5_000_000)), found.append)
    look(beside)
    assert found == [([0.6, 10_000_000], "")]


def test_what_is_dropped_hears_why_and_its_result_is_not_taken_for_the_next(beside: Beside) -> None:
    found: list[Any] = []
    for wait in (0.0, 2.0):  # before there is a process, and while it works
        for task in (2.5, 1):
            beside.begin(thinking(task), found.append)
        end = time.monotonic() + wait
        while time.monotonic() < end:
            beside.look()
        assert beside.drop(Dropped("no more")) == 2
        assert found == [([], "no more")] * 2 and not beside.is_busy
        beside.begin(thinking(5), found.append)
        look(beside)
        assert found.pop() == ([10], "")
        found.clear()
    assert beside.drop(Dropped("no more")) == 0


@pytest.mark.parametrize("is_killed", [False, True])
def test_a_process_that_has_ended_is_begun_anew_and_who_waited_hears_of_it(
    beside: Beside, is_killed: bool
) -> None:
    found: list[Any] = []
    beside.begin(thinking("who"), found.append)
    look(beside)
    beside.begin(thinking(30.0 if is_killed else "end"), found.append)
    if is_killed:
        os.kill(found[0][0][0], signal.SIGKILL)
    look(beside)
    code = -9 if is_killed else 3
    assert found[1] == ([], f"the process that works it out has ended ({code})")
    beside.begin(thinking(5), found.append)
    look(beside)
    assert found[2] == ([10], "")


def test_what_work_prints_is_no_result(beside: Beside) -> None:
    found: list[Any] = []
    beside.begin(thinking("print", 1), found.append)
    look(beside)
    assert found == [(["printprint", 2], "")]


def test_the_process_ends_with_who_began_it(beside: Beside) -> None:
    found: list[Any] = []
    beside.begin(thinking("who"), found.append)
    look(beside)
    pid = found[0][0][0]
    beside.end()
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


def test_what_cannot_be_made_is_told_to_all_who_wait() -> None:
    beside, found = Beside("test worker", broken), list[Any]()
    for _ in range(2):
        for task in (1, 2):
            beside.begin(thinking(task), found.append)
        look(beside)
        assert found == [([], "the process that works it out has ended (1)")] * 2
        found.clear()


URGENT = """
import os, time
from test_beside import look, made, thinking
from flexarm_model.process.beside import Beside
from flexarm_model.process.punctual import raise_priority, stay_on
cores = sorted(os.sched_getaffinity(0))
stay_on(cores[:1])
if why := raise_priority(1): print(why); raise SystemExit
beside, found = Beside("test worker", made, 2), []
beside.begin(thinking("how", "who"), found.append)
look(beside)
[how, who], _ = found[0]
print(how == (True, cores), os.sched_getscheduler(0) == os.SCHED_RR)
print(who, flush=True)
os._exit(0)
"""


def test_the_process_of_an_urgent_one_is_ordinary_may_use_every_core_and_does_not_outlive_it() -> None:
    folder = os.path.dirname(__file__)
    path = os.pathsep.join([folder, *filter(None, [os.environ.get("PYTHONPATH")])])
    done = subprocess.run(
        [sys.executable, "-c", URGENT],
        capture_output=True, text=True, check=True, env={**os.environ, "PYTHONPATH": path},
    )  # fmt: skip
    if "not permitted" in done.stdout:
        pytest.skip("this user may not raise priorities")
    *said, who = done.stdout.split()
    assert said == ["True", "True"]
    end = time.monotonic() + PATIENCE
    while os.path.exists(f"/proc/{who}/stat") and time.monotonic() < end:
        time.sleep(0.01)
    assert not os.path.exists(f"/proc/{who}/stat")
