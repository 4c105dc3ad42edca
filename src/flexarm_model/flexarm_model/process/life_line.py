"""The line of a process to who started it: when the process ends, its end of the line is let go of at once.

A process that is killed has ended only when each of its threads has, and its memory is given back: 10 to
30 ms for 100 MB, and 50 and more where nodes with a priority have the cores. One thread of it can be gone
within a millisecond: it has a priority where the user may have one, a table of open files of its own
(unshare(2)), and in this table nothing but the line.

Who starts a process makes one end of a pair of sockets its standard input, and says so in its environment.
"""

from __future__ import annotations

import ctypes
import os
import socket
from collections.abc import MutableMapping
from contextlib import suppress
from queue import SimpleQueue
from threading import Thread

MARK = "FLEXARM_LINE"
PRIORITY = 80  # SCHED_FIFO; the thread does nothing but end
_CLONE_FILES = 0x400  # linux/sched.h
_STANDARD_INPUT = 0


def take_line(environment: MutableMapping[str, str] = os.environ) -> socket.socket | None:
    """Return the line that is our standard input, and empty that; None where nobody has made it one."""
    if not environment.pop(MARK, ""):
        return None
    line = socket.socket(fileno=os.dup(_STANDARD_INPUT))
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, _STANDARD_INPUT)
    os.close(nothing)
    return line


def hold_until_the_end(line: socket.socket) -> None:
    """Hold a line as long as this process lives; nothing else may be done with it."""
    told: SimpleQueue[bool] = SimpleQueue()
    Thread(target=_hold, args=(line.fileno(), told), name="life line", daemon=True).start()
    if told.get():
        line.close()
    else:
        line.detach()  # it stays open until the kernel closes it


def _hold(line: int, told: SimpleQueue[bool]) -> None:
    is_alone = _has_own_files(line)
    told.put(is_alone)
    with suppress(OSError):  # who started us has been killed
        while is_alone and os.read(line, 1):
            pass


def _has_own_files(line: int) -> bool:
    """Give this thread a table of open files with nothing but the line; return whether it has one."""
    try:
        if ctypes.CDLL(None).unshare(_CLONE_FILES):
            return False
    except AttributeError:  # no Linux
        return False
    with suppress(OSError):  # no /proc
        for each in map(int, os.listdir("/proc/thread-self/fd")):
            if each != line:
                with suppress(OSError):  # what the list was read from is closed
                    os.close(each)
    with suppress(OSError):  # not permitted
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))  # of this thread alone
    return True
