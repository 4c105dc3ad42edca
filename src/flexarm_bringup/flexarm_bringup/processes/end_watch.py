"""Tells at once that a process has ended: a thread waits for what the kernel says of it.

That is the first of two: its line is let go of (``child``), within a millisecond where the process does so
(``flexarm_model.process.life_line``); or there is nothing left of it (pidfd_open(2); Linux from 5.3 on). Who
only looks now and then is late by his own work. Where the user may, the thread has a priority like those of
the nodes, so that a busy machine does not keep it waiting.
"""

from __future__ import annotations

import os
import selectors
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from threading import Lock, Thread

from flexarm_bringup.processes.child import Child

PRIORITY = 65  # SCHED_FIFO; below the guard, above what it watches


@dataclass
class _Watched:
    name: str
    descriptors: list[int] = field(default_factory=list)
    has_ended: bool = False


class EndWatch:
    """Waits for processes to end.

    The function is called in a thread of its own, once for every process.
    """

    def __init__(self, tell: Callable[[str], None]) -> None:
        """Wait for nobody yet; ``tell`` is given the name of who has ended."""
        self._tell = tell
        self._selector = selectors.DefaultSelector()
        self._changing = Lock()
        self._awake, self._wake = os.pipe()
        self._selector.register(self._awake, selectors.EVENT_READ)
        self._thread = Thread(target=self._wait, name="end watch", daemon=True)
        self._thread.start()

    def add(self, name: str, child: Child) -> None:
        """Wait for a process, too; also for one that has ended, but has not been asked for its exit code."""
        watched = _Watched(name, [os.dup(child.line.fileno())])
        with suppress(AttributeError, OSError):  # no Linux, an old one, or not permitted
            watched.descriptors.append(os.pidfd_open(child.pid))
        with self._changing:
            for descriptor in watched.descriptors:
                self._selector.register(descriptor, selectors.EVENT_READ, watched)

    def close(self) -> None:
        """Wait no more; nothing is told after this."""
        os.write(self._wake, b"x")
        self._thread.join()
        for descriptor in [*(key.fd for key in self._selector.get_map().values()), self._wake]:
            os.close(descriptor)
        self._selector.close()

    def _wait(self) -> None:
        with suppress(AttributeError, OSError):  # no Linux, or not permitted
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))  # of this thread alone
        while True:
            for key, _ in self._selector.select():
                if key.data is None:
                    return
                if not key.data.has_ended:
                    key.data.has_ended = True
                    self._tell(key.data.name)
                    self._forget(key.data)

    def _forget(self, watched: _Watched) -> None:
        with self._changing:
            for descriptor in watched.descriptors:
                self._selector.unregister(descriptor)
                os.close(descriptor)
