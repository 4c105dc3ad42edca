"""Tells at once that a process has ended: a thread waits for what the kernel says of it (pidfd_open(2)).

Who only looks now and then is late by his own work. Linux before 5.3 has no such descriptors: nothing is told
there, and who looks finds it. Where the user may, the thread has a priority like those of the nodes, so that
a busy machine does not keep it waiting.
"""

from __future__ import annotations

import os
import selectors
from collections.abc import Callable
from contextlib import suppress
from threading import Thread

PRIORITY = 65  # SCHED_FIFO; below the guard, above what it watches


class EndWatch:
    """Waits for processes to end.

    The function is called in a thread of its own, once for every process.
    """

    def __init__(self, tell: Callable[[str], None]) -> None:
        """Wait for nobody yet; ``tell`` is given the name of who has ended."""
        self._tell = tell
        self._selector = selectors.DefaultSelector()
        self._awake, self._wake = os.pipe()
        self._selector.register(self._awake, selectors.EVENT_READ, "")
        self._thread = Thread(target=self._wait, name="end watch", daemon=True)
        self._thread.start()

    def add(self, name: str, pid: int) -> None:
        """Wait for a process, too; also for one that has ended, but has not been asked for its exit code."""
        try:
            self._selector.register(os.pidfd_open(pid), selectors.EVENT_READ, name)
        except (AttributeError, OSError):  # no Linux, an old one, or not permitted
            return

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
                if not key.data:
                    return
                self._selector.unregister(key.fd)
                os.close(key.fd)
                self._tell(key.data)
