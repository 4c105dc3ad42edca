"""Which processes of a soak were killed on purpose, and which have ended by themselves."""

from __future__ import annotations

import os
import signal
from collections import Counter

from flexarm_bringup.processes.supervisor import Ending


class Killed:
    """Kills processes, and tells their ends from those that nobody meant.

    Attributes:
        own_ends: Processes that have ended by themselves, with exit code, and how often.
    """

    def __init__(self) -> None:
        """Nobody has ended yet."""
        self.own_ends: Counter[str] = Counter()
        self._expected: set[str] = set()

    def kill(self, name: str, pid: int) -> None:
        """Kill a process (SIGKILL); it must be told by ``note`` before its successor is killed."""
        os.kill(pid, signal.SIGKILL)
        self._expected.add(name)

    def note(self, ending: Ending) -> None:
        """Hear of a process that has ended; minus the signal that ended it is its exit code."""
        name = ending.process.name
        is_meant = name in self._expected and ending.code == -signal.SIGKILL
        self._expected.discard(name)
        if not is_meant:
            self.own_ends[f"{name} with {ending.code}"] += 1
