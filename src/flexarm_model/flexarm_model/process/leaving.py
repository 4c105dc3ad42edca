"""Leave a library within bounded time, whatever it does while it is taken down.

Fast DDS 2.14 as the wheels bring it may spin for minutes, holding Python's lock, when a participant is
destroyed while it hears of another one (its issue 6513): no handler of a signal and no thread of Python runs
then, and who had done its work would never say so. A timer of the system calls ``_exit`` in a thread of C.
"""

from __future__ import annotations

import ctypes
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

LEAVING = 2.0  # s; it takes 20 ms, some tenths of a second where others use the cores
_SIGEV_THREAD = 2  # <bits/sigevent-consts.h>


class _SigEvent(ctypes.Structure):
    """``struct sigevent`` of sigevent(3type): 64 bytes; what to call, and with what."""

    _fields_ = (
        ("value", ctypes.c_void_p), ("signo", ctypes.c_int), ("notify", ctypes.c_int),
        ("function", ctypes.c_void_p), ("attributes", ctypes.c_void_p), ("rest", ctypes.c_char * 32),
    )  # fmt: skip


class _TimerSpec(ctypes.Structure):
    """``struct itimerspec``: period and first time, seconds and nanoseconds each."""

    _fields_ = (("period", ctypes.c_long * 2), ("first", ctypes.c_long * 2))


@contextmanager
def ends_within(seconds: float, code: int) -> Iterator[None]:
    """End the process with an exit code if the block takes longer than so long [s].

    What was printed is flushed first; nothing else is done then: no ``finally``, no ``atexit``. Where the C
    library has no timers that start threads, the block takes as long as it takes.
    """
    take_back = end_within(seconds, code)
    try:
        yield
    finally:
        take_back()


def end_within(seconds: float, code: int) -> Callable[[], None]:
    """End the process with an exit code after so long [s], as ``ends_within``; returns what takes that back.

    For who has nothing left to do but to end: a library may hold him up even while Python takes itself down.
    """
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError, AttributeError):
            stream.flush()
    library = _with_timers()
    timer = ctypes.c_void_p()
    if library is None or library.timer_create(
        time.CLOCK_MONOTONIC, ctypes.byref(_exiting(library, code)), ctypes.byref(timer)
    ):
        return lambda: None
    first = divmod(round(seconds * 1e9), 10**9)
    library.timer_settime(timer, 0, ctypes.byref(_TimerSpec((0, 0), first)), None)
    return lambda: library.timer_delete(timer)


def _exiting(library: ctypes.CDLL, code: int) -> _SigEvent:
    """Return the event at which a new thread calls ``_exit(code)``."""
    function = ctypes.cast(library._exit, ctypes.c_void_p)
    return _SigEvent(value=code, notify=_SIGEV_THREAD, function=function)


def _with_timers() -> ctypes.CDLL | None:
    """Return the C library, or librt, where timers were before glibc 2.34."""
    for name in (None, "librt.so.1"):
        with suppress(OSError, AttributeError):
            library = ctypes.CDLL(name)
            if library.timer_create and library._exit:  # looked up by asking
                return library
    return None
