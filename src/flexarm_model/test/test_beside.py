"""Work beside a loop: the same at once and in a thread, in order, dropped with a reason."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import pytest

from flexarm_model.process.beside import Beside, Thoughts, at_once

PATIENCE = 30.0  # s


class Dropped(Exception):
    """Why work comes to nothing."""


def sums(*numbers: int, work: Callable[[int], int] = abs) -> Thoughts[tuple[int, list[str]]]:
    """Add up what work makes of numbers; tells in which thread each was added, and what went wrong."""
    total, where = 0, list[str]()
    for number in numbers:
        try:
            total += yield partial(work, number)
        except Dropped as why:
            return total, [str(why)]
        where.append(threading.current_thread().name)
    return total, where


@pytest.fixture
def beside() -> Iterator[Beside]:
    """Give one that ends with the test."""
    made = Beside()
    yield made
    if made._pool is not None:
        made._pool.shutdown()


def look(beside: Beside) -> None:
    """Look until nothing is under way."""
    end = time.monotonic() + PATIENCE
    while beside.is_busy and time.monotonic() < end:
        beside.look()
    assert not beside.is_busy


def test_thoughts_come_to_the_same_at_once_and_beside_the_loop_which_does_the_rest(beside: Beside) -> None:
    found: list[Any] = []
    here = threading.current_thread().name
    assert at_once(sums(1, -2, 3)) == (6, [here] * 3)
    beside.begin(sums(1, -2, 3), found.append)
    look(beside)
    assert found == [(6, [here] * 3)]
    assert at_once(sums()) == (0, [])


def test_what_takes_long_is_done_in_another_thread_in_the_order_in_which_it_came(beside: Beside) -> None:
    done: list[tuple[int, str]] = []
    found: list[Any] = []

    def work(number: int) -> int:
        """Note who does it."""
        time.sleep(0.01 * (3 - number))
        done.append((number, threading.current_thread().name))
        return number

    for number in range(3):
        beside.begin(sums(number, work=work), found.append)
    assert not found
    look(beside)
    assert [number for number, _ in done] == [total for total, _ in found] == [0, 1, 2]
    assert len({name for _, name in done}) == 1
    assert done[0][1] != threading.current_thread().name


def test_thoughts_that_need_no_work_are_done_at_once(beside: Beside) -> None:
    found: list[Any] = []
    beside.begin(sums(), found.append)
    assert found == [(0, [])] and not beside.is_busy


def test_the_loop_is_never_kept_waiting(beside: Beside) -> None:
    going = threading.Event()
    found: list[Any] = []
    beside.begin(sums(1, work=lambda number: number * going.wait(PATIENCE)), found.append)
    beside.look()
    assert beside.is_busy and not found
    going.set()
    look(beside)
    assert found[0][0] == 1


def test_what_is_dropped_hears_why_and_its_work_comes_to_nothing(beside: Beside) -> None:
    going = threading.Event()
    found: list[Any] = []
    for number in (1, 2):
        beside.begin(sums(number, work=lambda number: number * going.wait(PATIENCE)), found.append)
    assert beside.drop(Dropped("no more")) == 2
    assert found == [(0, ["no more"])] * 2 and not beside.is_busy
    going.set()
    beside.begin(sums(5), found.append)
    look(beside)
    assert found[2][0] == 5
    assert beside.drop(Dropped("no more")) == 0


def test_what_goes_wrong_in_work_is_raised_in_the_loop(beside: Beside) -> None:
    beside.begin(sums(1, work=lambda number: number // 0), lambda found: None)
    with pytest.raises(ZeroDivisionError):
        look(beside)
