"""Does the machine itself stand still? One witness per core does nothing but sleep, before everybody else.

Run as a program with the numbers of a core and of the process that asks, it sleeps ``STEP`` at a time there
with SCHED_FIFO ``PRIORITY``, above every node, and prints from when to when it was not woken although it
should have been. No node can be punctual while its witness is not: the host took the processor away, or the
kernel did not give it.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import IO

PRIORITY = 90  # the guard has 70
STEP = 1e-3  # s
LONGEST = 2e-3  # s; a witness that is woken later has seen a standstill
NOT_PERMITTED = 3


@dataclass(frozen=True)
class Standstill:
    """A core gave nobody time, ``start`` to ``end`` [s] of the steady clock."""

    start: float
    end: float

    @property
    def seconds(self) -> float:
        """How long [s]."""
        return self.end - self.start


class Witnesses:
    """One on every core that this process may use; a context, after which ``standstills`` is complete.

    Attributes:
        standstills: What was seen, in order of time.
        are_heard: False where the user may not raise priorities: their sleep would prove nothing.
    """

    def __init__(self) -> None:
        """Start nothing yet."""
        self.standstills: Sequence[Standstill] = ()
        self.are_heard = True
        self._files: list[IO[str]] = []
        self._children: list[subprocess.Popen[bytes]] = []

    def __enter__(self) -> Witnesses:
        """Begin to watch."""
        for core in sorted(os.sched_getaffinity(0)):
            self._files.append(tempfile.TemporaryFile("w+"))  # noqa: SIM115 (closed in __exit__)
            command = [sys.executable, "-m", __name__, str(core), str(os.getpid())]
            self._children.append(subprocess.Popen(command, stdout=self._files[-1]))
        return self

    def __exit__(self, *_: object) -> None:
        """Hear what they have seen."""
        seen: list[Standstill] = []
        for child, file in zip(self._children, self._files, strict=True):
            self.are_heard &= child.poll() is None
            child.terminate()
            child.wait()
            file.seek(0)
            rows = (line.split() for line in file if line.endswith("\n"))
            seen += [Standstill(float(start), float(end)) for start, end in rows]
            file.close()
        self.standstills = sorted(seen, key=lambda each: each.start)

    @property
    def seen(self) -> str:
        """What was seen, in words; empty where the machine ran, or nobody could watch."""
        if not self.standstills or not self.are_heard:
            return ""
        longest = max(each.seconds for each in self.standstills)
        count = len(self.standstills)
        return f"the machine itself stood still: {count} times, for {1e3 * longest:.0f} ms at most"


def watch(core: int, parent: int) -> int:
    """Sleep on a core while the process that started this one lives, and print every standstill.

    Returns:
        Exit code.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C in a terminal: it ends with its parent
    try:
        os.sched_setaffinity(0, {core})
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    except PermissionError:
        return NOT_PERMITTED
    now = time.monotonic()
    while os.getppid() == parent:
        due = now + STEP
        time.sleep(STEP)
        now = time.monotonic()
        if now - due > LONGEST:
            print(f"{due:.6f} {now:.6f}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(watch(*map(int, sys.argv[1:])))
