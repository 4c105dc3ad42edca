"""Processes that wait to take the place of others (``flexarm_model.process.reserve``), for who starts them.

Loading its libraries is most of what a node does until its first word. A reserve has done it before; calling
it takes no longer than writing a byte. There is one for every process, its own executable with its arguments.
"""

from __future__ import annotations

import fcntl
import signal
import socket
import struct
import termios
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from flexarm_bringup.processes.child import Child
from flexarm_bringup.processes.graph import Process
from flexarm_model.process.reserve import COME, LOADED

TAKEN_WITHIN = 1.0  # s; one that is awake hears its call within milliseconds, on a busy machine within 0.1 s
_LOOK_PERIOD = 1e-3  # s


@dataclass
class Reserve:
    """One process in reserve.

    Attributes:
        child: The process.
        is_loaded: It has told that it can be called.
    """

    child: Child
    is_loaded: bool = False

    def hear(self) -> None:
        """Take note of what it has told, if anything."""
        if self.is_loaded:
            return
        try:
            self.is_loaded = self.child.line.recv(1, socket.MSG_DONTWAIT) == LOADED
        except OSError:  # nothing yet, or it has ended
            return

    def call(self) -> bool:
        """Call it to its place; return whether it goes there: one that hangs, or is swapped out, does not."""
        self.hear()
        if not self.is_loaded or self.child.poll() is not None:
            return False
        try:
            self.child.line.sendall(COME)
        except OSError:  # it ends just now
            return False
        deadline = time.monotonic() + TAKEN_WITHIN
        while _has_unread(self.child.line):
            if time.monotonic() > deadline:
                return False
            time.sleep(_LOOK_PERIOD)
        return True

    def end(self) -> None:
        """End it at once: it holds nothing."""
        self.child.line.close()
        self.child.signal(signal.SIGKILL)
        self.child.process.wait()


class Reserves:
    """At most one reserve for every process of a graph."""

    def __init__(self, start: Callable[[Process], Child]) -> None:
        """Have none; ``start`` starts one."""
        self._start = start
        self._waiting: dict[str, Reserve] = {}

    def provide(self, processes: Sequence[Process]) -> bool:
        """Start the next one that is missing unless one is loading; return whether all are there.

        One that has ended by itself is not started again: its node would not start either.
        """
        for process in processes:
            if process.name not in self._waiting:
                try:
                    self._waiting[process.name] = Reserve(self._start(process))
                except OSError:  # its package is just being built, say: tried again the next time
                    return False
            reserve = self._waiting[process.name]
            reserve.hear()
            if not reserve.is_loaded and reserve.child.poll() is None:
                return False
        return True

    def call(self, name: str) -> Child | None:
        """Return the reserve of a process, called to its place; None when there is none that could come."""
        reserve = self._waiting.pop(name, None)
        if reserve is None or reserve.call():
            return None if reserve is None else reserve.child
        reserve.end()
        return None

    def end(self) -> None:
        """End all that wait."""
        for reserve in self._waiting.values():
            reserve.end()
        self._waiting.clear()


def _has_unread(line: socket.socket) -> bool:
    """Return whether the other end has not read all yet (SIOCOUTQ of a Unix socket; unix(7))."""
    try:
        (waiting,) = struct.unpack("i", fcntl.ioctl(line, termios.TIOCOUTQ, b"\0" * 4))
    except OSError:  # a kernel that does not tell
        return False
    return bool(waiting)
