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

from flexarm_model.process.punctual import anywhere, ordinary_children
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

    It begins with the first of them, and ends with this one. One that has ended by itself is begun anew.
    """

    def __init__(self, name: str, make: Callable[..., Callable[[Any], Any]], *arguments: Any) -> None:
        """Begin nothing yet.

        Args:
            name: What ``ps`` shows.
            make: Function of a module; makes of the arguments what does a task.
            arguments: Of it. They, tasks and results can be pickled.
        """
        self._name, self._first = name, framed((make, arguments))
        self._process: subprocess.Popen[bytes] | None = None
        self._new = deque[tuple[Thoughts[Any], Callable[[Any], None]]]()
        self._waiting = deque[tuple[Thoughts[Any], Callable[[Any], None], Any]]()
        self._is_made = self._is_at_work = self._is_idle_talk = False

    @property
    def is_busy(self) -> bool:
        """Whether thoughts are under way."""
        return bool(self._new or self._waiting)

    def begin(self, thoughts: Thoughts[T], done: Callable[[T], None]) -> None:
        """Begin as soon as there is a process; ``done`` takes what they come to."""
        if self._process is None:
            self._start()
        self._new.append((thoughts, done))
        self._give()

    def look(self) -> None:
        """Go on with those whose task is done; to be called by the loop, which it never keeps waiting."""
        if self._process is None:
            return
        self._write()
        for result in self._results():
            self._take(result)
        if (code := self._process.poll()) is not None:
            self.end()
            self.drop(WorkLost(f"the process that works it out has ended ({code})"))
        self._give()

    def drop(self, why: Exception) -> int:
        """Raise ``why`` where thoughts wait for a result, which nobody takes then; returns in how many."""
        new, self._new = self._new, deque()
        for thoughts, done in new:
            self._go_on(thoughts, done, partial(next, thoughts))
        dropped, self._waiting = self._waiting, deque()
        self._is_idle_talk = self._is_at_work
        for thoughts, done, _ in dropped:
            self._go_on(thoughts, done, partial(thoughts.throw, why))
        return len(dropped)

    def end(self) -> None:
        """End the process, whatever it does."""
        if self._process is not None:
            with self._process as process:  # closes the pipes, waits
                process.kill()
        self._process = None
        self._is_made = self._is_at_work = self._is_idle_talk = False

    def _start(self) -> None:
        pipe, cores = subprocess.PIPE, ",".join(map(str, anywhere()))
        command = [sys.executable, "-m", MODULE, self._name, str(os.getpid()), cores]
        with ordinary_children():  # nothing is called between fork and exec: that would copy this process
            self._process = subprocess.Popen(
                command, bufsize=0, stdin=pipe, stdout=pipe, start_new_session=True
            )
        assert self._process.stdin is not None and self._process.stdout is not None
        self._tasks, self._found = self._process.stdin.fileno(), self._process.stdout.fileno()
        for each in (self._tasks, self._found):
            os.set_blocking(each, False)
        self._unsent, self._unread = bytearray(self._first), bytearray()
        self._write()

    def _take(self, result: Any) -> None:
        """Go on with a result; the first one says that the process has made what it works with."""
        is_wanted, self._is_made = self._is_made and not self._is_idle_talk, True
        self._is_at_work = self._is_idle_talk = False
        if is_wanted:
            thoughts, done, _ = self._waiting.popleft()
            self._go_on(thoughts, done, partial(thoughts.send, result))

    def _go_on(self, thoughts: Thoughts[T], done: Callable[[T], None], step: Callable[[], Any]) -> None:
        try:
            task = step()
        except StopIteration as end:
            done(end.value)
        else:
            self._waiting.append((thoughts, done, task))

    def _give(self) -> None:
        """Begin what is new, and send the next task if nothing is worked at."""
        while self._is_made and self._new:
            thoughts, done = self._new.popleft()
            self._go_on(thoughts, done, partial(next, thoughts))
        if self._waiting and self._is_made and not self._is_at_work:
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
