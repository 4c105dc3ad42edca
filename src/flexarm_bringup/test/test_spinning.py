"""Ctrl-C does not cut through what an executor is doing, and is not lost."""

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator

import pytest

from flexarm_bringup.processes.asked_to_end import ENDING, noting_signals
from flexarm_bringup.processes.spinning import spin_once


class Executor:
    """Does one thing when it is spun, and remembers how long it might have waited."""

    def __init__(self, work: Callable[[], None]) -> None:
        self.work, self.has_done, self.timeout = work, False, 0.0

    def spin_once(self, timeout_sec: float) -> None:
        self.timeout = timeout_sec
        self.work()
        time.sleep(0.0)  # where a handler would run
        self.has_done = True


def ask(number: int) -> Executor:
    return Executor(lambda: os.kill(os.getpid(), number))


@pytest.fixture(autouse=True)
def same_handlers() -> Iterator[None]:
    ours = signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell may have had it ignored
    before = {number: signal.getsignal(number) for number in ENDING}
    yield
    assert {number: signal.getsignal(number) for number in ENDING} == before
    signal.signal(signal.SIGINT, ours)


def test_ctrl_c_in_the_middle_of_a_callback_comes_after_it() -> None:
    executor = ask(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        spin_once(executor, 0.05)
    assert executor.has_done


def test_who_notes_signals_hears_of_it() -> None:
    with noting_signals() as asked_to_end:
        executor = ask(signal.SIGTERM)
        spin_once(executor, 0.05)
        assert executor.has_done and asked_to_end()


def test_an_error_of_a_callback_is_told_as_it_is() -> None:
    def fail() -> None:
        raise ValueError("told")

    with pytest.raises(ValueError, match="told"):
        spin_once(Executor(fail), 0.05)


@pytest.mark.parametrize(("asked", "given"), [(0.02, 0.02), (5.0, 0.1)])
def test_a_signal_never_waits_for_long(asked: float, given: float) -> None:
    executor = Executor(lambda: None)
    spin_once(executor, asked)
    assert executor.timeout == given


def test_who_hears_much_works_several_times_and_waits_for_the_first_alone() -> None:
    """To hold signals back took 35 % of a listener to a thousand messages a second, which fell behind."""
    waited: list[float] = []
    executor = Executor(lambda: waited.append(executor.timeout))
    spin_once(executor, 0.05, most=4)
    assert waited == [0.05, 0.0, 0.0, 0.0]


def test_another_thread_spins_too() -> None:
    executor = Executor(lambda: None)
    thread = threading.Thread(target=spin_once, args=(executor, 0.05))
    thread.start()
    thread.join()
    assert executor.has_done
