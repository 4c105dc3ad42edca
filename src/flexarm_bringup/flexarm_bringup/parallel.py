"""Independent jobs on all cores, in processes of their own; results come in the order of the jobs."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from typing import TypeVar

from flexarm_model.process.announce import announce_on_stderr

Job = TypeVar("Job")
Result = TypeVar("Result")


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
        done: Told after each job how many of how many are done.
        workers: Number of processes; None takes the cores there are.
    """
    workers = min(workers or len(os.sched_getaffinity(0)), max(len(todo), 1))
    results: dict[int, Sequence[Result]] = {}
    spawn = get_context("spawn")
    with ProcessPoolExecutor(workers, mp_context=spawn, initializer=announce_on_stderr) as pool:
        futures = {pool.submit(run, job): i for i, job in enumerate(todo)}
        for future in as_completed(futures):
            results[futures[future]] = future.result()
            done(len(results), len(todo))
    return [result for i in range(len(todo)) for result in results[i]]
