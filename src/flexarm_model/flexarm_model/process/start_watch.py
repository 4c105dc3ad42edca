"""End a process that hangs while it starts, and say where; who watches over it starts it again.

Fast DDS 2.14 as the wheels bring it may block for ever between the discovery of others and the making of a
first topic (its issues 3822 and 6513 are of this family). Python's lock may be held then, so both clocks run
in threads of C: the first writes the stacks of all threads to stderr, the second ends the process.

A start may take minutes where many share the cores. So a thread sets the clocks back whenever the main thread
has used some processor time: who is blocked uses none, and who holds Python's lock keeps that thread waiting.
"""

from __future__ import annotations

import faulthandler
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from flexarm_model.process.leaving import end_within

EXIT_STUCK = 4  # exit code of who hung
PATIENCE = 60.0  # s without a sign of life
WRITING = 1.0  # s to write the stacks
LOOKS = 10  # at the processor time, in that patience
BUSY = 2e-3  # share of the time between two looks that who works uses at least [1]; two cores for hundreds
_running: list[StartWatch] = []  # the one of this process, while it starts


class StartWatch:
    """Runs from its making, by the thread that starts the process, until ``end``."""

    def __init__(self, patience: float | None = None) -> None:
        """Start the clocks: ``patience`` is the time without a sign of life [s]; by default ``PATIENCE``."""
        self._patience = PATIENCE if patience is None else patience
        self._processor = time.pthread_getcpuclockid(threading.get_ident())
        self._over, self._is_paused, self._turn = threading.Event(), False, threading.Lock()
        self._take_back: Callable[[], None] = lambda: None
        _running.append(self)
        self._set_clocks()
        threading.Thread(target=self._look, name="start watch", daemon=True).start()

    def pause(self) -> None:
        """Stop the clocks."""
        with self._turn:
            self._is_paused = True
            self._stop_clocks()

    def go_on(self) -> None:
        """Start the clocks anew."""
        with self._turn:
            self._is_paused = False
            self._set_clocks()

    def end(self) -> None:
        """The start is over; may be said again."""
        if self in _running:
            _running.remove(self)
            self._over.set()
            self.pause()

    def _look(self) -> None:
        period, used = self._patience / LOOKS, time.clock_gettime(self._processor)
        while not self._over.wait(period):
            before, used = used, time.clock_gettime(self._processor)
            with self._turn:
                if used - before > BUSY * period and not self._is_paused:
                    self._set_clocks()

    def _set_clocks(self) -> None:
        self._stop_clocks()
        faulthandler.dump_traceback_later(self._patience, file=sys.__stderr__ or sys.stderr)
        self._take_back = end_within(self._patience + WRITING, EXIT_STUCK)

    def _stop_clocks(self) -> None:
        self._take_back()
        self._take_back = lambda: None
        faulthandler.cancel_dump_traceback_later()


@contextmanager
def takes_long() -> Iterator[None]:
    """Stop the clocks, where they run, while something takes as long as it takes, such as compiling."""
    for watch in _running:
        watch.pause()
    try:
        yield
    finally:
        for watch in _running:
            watch.go_on()
