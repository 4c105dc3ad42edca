"""What a process asks of the system so that it is on time: a priority, and cores of its own (sched(7)).

A process that changes cores finds its caches cold, and two that answer each other in turn wait for the same
core while another one is free. Threads that are begun later inherit both.

Threads of one priority take turns (SCHED_RR), 0.1 s each where nobody has to wait earlier. With SCHED_FIFO
the first one would keep the core: a thread of DDS that tries again and again for a lock that another one
holds, which waits for that core, then hangs its node for ever.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager, suppress

_THREADS = "/proc/self/task"
_allowed: set[int] = set()  # cores this process might run on before it stayed on some of them


def raise_priority(priority: int) -> str:
    """Give all threads of this process a SCHED_RR priority; none for 0.

    Returns:
        Why it was not done; empty when it was, or nothing was asked.
    """

    def raise_one(thread: int) -> None:
        """Raise one thread."""
        os.sched_setscheduler(thread, os.SCHED_RR, os.sched_param(priority))

    if not priority or _of_all_threads(raise_one):
        return ""
    return f"realtime_priority {priority} is not permitted; running with ordinary priority"


def stay_on(cores: Collection[int]) -> str:
    """Let all threads of this process run on these cores alone; on any for none.

    Returns:
        Why it was not done; empty when it was, or nothing was asked.
    """
    allowed = os.sched_getaffinity(0)
    if not cores:
        return ""
    if not allowed.issuperset(cores):
        there = ", ".join(map(str, sorted(allowed)))
        return f"cores {list(cores)}: this process may run on {there}; it stays on all of them"
    _allowed.update(allowed)
    if _of_all_threads(lambda thread: os.sched_setaffinity(thread, cores)):
        return ""
    return f"cores {list(cores)} are not permitted; running on any"


def _of_all_threads(change: Callable[[int], None]) -> bool:
    """Change every thread; return whether that was permitted. One that has ended meanwhile needs nothing."""
    for thread in os.listdir(_THREADS):
        try:
            change(int(thread))
        except ProcessLookupError:
            continue
        except OSError:
            return False
    return True


def be_ordinary() -> None:
    """Let the calling thread run as any other, on any core, from now on.

    What a thread beside the loop thinks about would keep the loop from its core for the 0.1 s of a turn, and
    an ordinary one gets next to nothing of a core that an urgent process fills.
    """
    kept = os.sched_getscheduler(0) & os.SCHED_RESET_ON_FORK  # see ``ordinary_children``
    os.sched_setscheduler(0, os.SCHED_OTHER | kept, os.sched_param(0))
    if _allowed:
        os.sched_setaffinity(0, _allowed)


def anywhere() -> list[int]:
    """Return the cores that this process might run on before it stayed on some of them."""
    return sorted(_allowed or os.sched_getaffinity(0))


@contextmanager
def ordinary_children() -> Iterator[None]:
    """Let processes that the calling thread begins meanwhile be ordinary ones; their cores are this one's."""
    policy, priority = os.sched_getscheduler(0), os.sched_getparam(0)
    if _is_ordinary(policy):
        yield
        return
    os.sched_setscheduler(0, policy | os.SCHED_RESET_ON_FORK, priority)
    try:
        yield
    finally:
        with suppress(PermissionError):  # only root may take it back; its threads are ordinary, too, then
            os.sched_setscheduler(0, policy, priority)


def _is_ordinary(policy: int) -> bool:
    return policy & ~os.SCHED_RESET_ON_FORK == os.SCHED_OTHER


@contextmanager
def ordinary_priority() -> Iterator[None]:
    """Let the calling thread run as any other meanwhile: what takes long must not hold up who is urgent.

    Threads that it begins meanwhile get its own priority and cores in the end.
    """
    policy, priority = os.sched_getscheduler(0), os.sched_getparam(0)
    if _is_ordinary(policy):
        yield
        return
    cores, before = os.sched_getaffinity(0), set(os.listdir(_THREADS))
    be_ordinary()
    try:
        yield
    finally:
        for thread in {"0"} | set(os.listdir(_THREADS)) - before:
            with suppress(ProcessLookupError):  # it has ended meanwhile
                os.sched_setaffinity(int(thread), cores)
                os.sched_setscheduler(int(thread), policy, priority)
