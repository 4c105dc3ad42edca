"""Runs with nodes: those in lockstep side by side, then those by the clock one after the other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Generic, TypeVar

from flexarm_bringup.demo_run.sessions import free_domains
from flexarm_bringup.page.check import Check
from flexarm_bringup.parallel import run_parallel
from flexarm_bringup.progress import Progress

Run = TypeVar("Run")
Say = Callable[[str], None]  # told what is being waited for


@dataclass(frozen=True)
class NodesRun(Generic[Run]):
    """What to run.

    Attributes:
        name: For messages.
        lockstep: By messages, or by the clock.
        run: Does it in a ROS domain that nobody else uses; returns the run, or the missed bound of one that
            came to no end. A worker process must be able to receive it.
    """

    name: str
    lockstep: bool
    run: Callable[[int, Say], Run | Check]


def run_all(todo: Sequence[NodesRun[Run]], progress: Progress) -> tuple[list[Run], list[Check]]:
    """Run them all.

    Returns:
        The runs, and a missed bound for each that came to no end.
    """
    numbered = list(zip(free_domains(), todo, strict=False))
    beside = [job for job in numbered if job[1].lockstep]
    found = run_parallel(_run_silently, beside, partial(_count, progress)) if beside else []
    for domain, job in numbered:
        if not job.lockstep:
            found.append(job.run(domain, partial(_say, progress, job.name)))
    failures = [result for result in found if isinstance(result, Check)]
    return [result for result in found if not isinstance(result, Check)], failures


def _run_silently(numbered: tuple[int, NodesRun[Run]]) -> list[Run | Check]:
    domain, job = numbered
    return [job.run(domain, lambda text: None)]


def _count(progress: Progress, done: int, of: int) -> None:
    progress.say(f"nodes over DDS, in lockstep: {done} of {of} runs")


def _say(progress: Progress, name: str, text: str) -> None:
    progress.say(f"nodes over DDS, {name}: {text}")
