"""A process that we have started, and the line between it and us (``flexarm_model.process.life_line``).

It has its own process group, and its kernel sends it SIGTERM should we be killed.
"""

from __future__ import annotations

import os
import signal
import socket
import subprocess
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from flexarm_bringup.processes.asked_to_end import holding_signals_back
from flexarm_model.process.life_line import MARK
from flexarm_model.process.parent import ending_with


@dataclass(frozen=True)
class Child:
    """One process.

    Attributes:
        process: The process.
        line: Our end of its standard input; it is closed there when the process ends.
    """

    process: subprocess.Popen[bytes]
    line: socket.socket

    @property
    def pid(self) -> int:
        """Its number."""
        return self.process.pid

    def poll(self) -> int | None:
        """Return its exit code, or None while it runs; minus the signal that ended it."""
        return self.process.poll()

    def signal(self, number: int) -> None:
        """Send a signal to it and to all that it has started, unless it has ended."""
        if self.poll() is None:
            with suppress(ProcessLookupError):  # ended meanwhile
                os.killpg(self.pid, number)


def start_child(command: Sequence[str], environment: Mapping[str, str], log: Path) -> Child:
    """Start a process.

    Args:
        command: Its command line.
        environment: All of its environment, but for the mark of the line.
        log: Gets what it prints, behind what others print there.
    """
    ours, theirs = socket.socketpair()
    try:
        with theirs, log.open("ab") as out, holding_signals_back():
            process = subprocess.Popen(
                command,
                env={**environment, MARK: "1"},
                stdin=theirs.fileno(),
                stdout=out,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                preexec_fn=_die_with(os.getpid()),
            )
    except BaseException:
        ours.close()
        raise
    return Child(process, ours)


def _die_with(parent: int) -> Callable[[], None]:
    """Return what a child does before it becomes the program.

    It asks for SIGTERM when the parent dies, and hears SIGINT even if a shell that started us in the
    background had it ignored.
    """
    parent_lives = ending_with(parent)

    def ask() -> None:
        """Make the calls; between fork and exec."""
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        if not parent_lives():
            os._exit(1)

    return ask
