"""Independent jobs on all cores, in processes of their own; results come in the order of the jobs.

No worker outlives who gave it work: the kernel ends it with that process, Ctrl-C or an error at once.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import active_children, get_context
from typing import TypeVar

from flexarm_bringup.worker_error import WorkerError
from flexarm_model.process.announce import announce_on_stderr
from flexarm_model.process.parent import ending_with

Job = TypeVar("Job")
Result = TypeVar("Result")
TELL_PERIOD = 1.0  # s


def run_parallel(
    run: Callable[[Job], Sequence[Result]],
    todo: Sequence[Job],
    done: Callable[[int, int], None],
    workers: int | None = None,
) -> list[Result]:
    """Run jobs and return all their results, one after the other.

    Args:
        run: What a worker does with a job; a function of a module.
        todo: The jobs.
        done: Told how many of how many jobs are done: at first, every second, and when any has ended.
        workers: Number of processes; None takes the cores there are.

    Raises:
        WorkerError: A process was killed at its work.
    """
    results: dict[int, Sequence[Result]] = {}
    with worker_pool(min(workers or cores(), max(len(todo), 1))) as pool:
        futures = {pool.submit(run, job): i for i, job in enumerate(todo)}
        running = set(futures)
        while running:
            done(len(results), len(todo))
            ended, running = wait(running, TELL_PERIOD, FIRST_COMPLETED)
            results.update((futures[future], future.result()) for future in ended)
        done(len(results), len(todo))
    return [result for i in range(len(todo)) for result in results[i]]


def cores() -> int:
    """Return how many this process may use."""
    return len(os.sched_getaffinity(0))


@contextmanager
def worker_pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Offer so many processes for the time of a block; an error in it ends them, whatever they do.

    Raises:
        WorkerError: The kernel or somebody else has killed one of them.
    """
    others, spawn = set(active_children()), get_context("spawn")
    pool = ProcessPoolExecutor(workers, mp_context=spawn, initializer=_begin, initargs=(os.getpid(),))
    try:
        yield pool
    except BrokenProcessPool:
        raise WorkerError("a worker process was killed at its work: for want of memory?") from None
    except BaseException:
        for worker in set(active_children()) - others:
            worker.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _begin(parent: int) -> None:
    """Begin a worker: Ctrl-C is its parent's affair, and so is when it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    announce_on_stderr()
    if not ending_with(parent)():
        raise SystemExit(1)
