"""What takes longer than a period, thought about beside the loop of a node.

It is written as a generator: it yields a task, and goes on with the result. Everything between is done by who
drives it: at once, or in the loop when the result is there. Tasks are done by a process of its own. A thread
would not do: where it holds the interpreter and waits for a core, the loop waits, too, however urgent it is.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections import deque
from collections.abc import Callable, Generator
from contextlib import suppress
from functools import partial
from typing import Any, TypeVar

from flexarm_model.process.parent import ending_with
from flexarm_model.process.worker import HEAD, MODULE, framed

T = TypeVar("T")
Thoughts = Generator[Any, Any, T]
ROOM = 1 << 20  # bytes of results that are read at once


class WorkLost(RuntimeError):
    """The process that was to do a task has ended."""


def at_once(thoughts: Thoughts[T], work: Callable[[Any], Any]) -> T:
    """Do all of it here and now; ``work`` does the tasks."""
    result = None
    while True:
        try:
            task = thoughts.send(result)
        except StopIteration as end:
            return end.value  # type: ignore[no-any-return]
        result = work(task)


class Beside:
    """One ordinary process for the tasks of all thoughts, in the order in which they came.

    It ends with this one. One that has ended by itself is begun anew.

    Attributes:
        is_ready: It has made what it works with.
    """

    def __init__(self, name: str, make: Callable[..., Callable[[Any], Any]], *arguments: Any) -> None:
        """Begin the process, which makes what it works with.

        Args:
            name: What ``ps`` shows.
            make: Function of a module; makes of the arguments what does a task.
            arguments: Of it. They, tasks and results can be pickled.
        """
        self._name, self._first = name, framed((make, arguments))
        self._waiting = deque[tuple[Thoughts[Any], Callable[[Any], None], Any]]()
        self._dropped = 0  # results that nobody waits for any more
        self.is_ready = False
        self._start()

    @property
    def is_busy(self) -> bool:
        """Whether thoughts are under way."""
        return bool(self._waiting)

    def begin(self, thoughts: Thoughts[T], done: Callable[[T], None]) -> None:
        """Begin; ``done`` takes what they come to, at once where there is no task."""
        self._go_on(thoughts, done, partial(next, thoughts))
        self._give()

    def look(self) -> None:
        """Go on with those whose task is done; to be called by the loop, which it never keeps waiting."""
        if self._is_over:
            return
        self._write()
        for result in self._results():
            if not self.is_ready:
                self.is_ready = True
                continue
            self._is_at_work = False
            if self._dropped:
                self._dropped -= 1
                continue
            thoughts, done, _ = self._waiting.popleft()
            self._go_on(thoughts, done, partial(thoughts.send, result))
        if self._process.poll() is not None:
            code = self._process.returncode
            self.end()
            self._start()
            self.drop(WorkLost(f"the process that works it out has ended ({code}); another one is begun"))
        self._give()

    def drop(self, why: Exception) -> int:
        """Raise ``why`` where thoughts wait for a result, which nobody takes then; returns in how many."""
        dropped, self._waiting = self._waiting, deque()
        self._dropped = int(self._is_at_work)
        for thoughts, done, _ in dropped:
            self._go_on(thoughts, done, partial(thoughts.throw, why))
        return len(dropped)

    def end(self) -> None:
        """End the process, whatever it does; nothing is looked at or begun any more."""
        self._is_over = True
        with self._process as process:  # closes the pipes, waits
            process.kill()

    def _start(self) -> None:
        ending, pipe = ending_with(os.getpid()), subprocess.PIPE
        command = [sys.executable, "-m", MODULE, self._name]
        self._process = subprocess.Popen(
            command, bufsize=0, stdin=pipe, stdout=pipe, start_new_session=True, preexec_fn=ending
        )
        assert self._process.stdin is not None and self._process.stdout is not None
        self._tasks, self._found = self._process.stdin.fileno(), self._process.stdout.fileno()
        for each in (self._tasks, self._found):
            os.set_blocking(each, False)
        self._unsent, self._unread = bytearray(self._first), bytearray()
        self.is_ready = self._is_over = self._is_at_work = False
        self._dropped = 0
        self._write()

    def _go_on(self, thoughts: Thoughts[T], done: Callable[[T], None], step: Callable[[], Any]) -> None:
        try:
            task = step()
        except StopIteration as end:
            done(end.value)
        else:
            self._waiting.append((thoughts, done, task))

    def _give(self) -> None:
        """Send the next task if nothing is worked at."""
        if self._waiting and not self._is_at_work:
            self._is_at_work = True
            self._unsent += framed(self._waiting[0][2])
            self._write()

    def _write(self) -> None:
        with suppress(BlockingIOError, BrokenPipeError):
            while self._unsent:
                del self._unsent[: os.write(self._tasks, self._unsent)]

    def _results(self) -> list[Any]:
        """Return what has come by now."""
        with suppress(BlockingIOError):
            while part := os.read(self._found, ROOM):
                self._unread += part
        results = []
        while len(self._unread) >= HEAD.size:
            end = HEAD.size + HEAD.unpack_from(self._unread)[0]
            if len(self._unread) < end:
                break
            results.append(pickle.loads(self._unread[HEAD.size : end]))
            del self._unread[:end]
        return results
