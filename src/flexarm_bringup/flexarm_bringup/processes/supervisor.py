"""Starts the processes of a graph on a machine without ``ros2 launch``, and takes them all down.

Every child has its own process group, so that Ctrl-C in the terminal reaches only the supervisor, which then
stops the children in order: SIGINT, SIGTERM, SIGKILL, each after a grace period. Whether a node is ready is
told by its ``~/ready`` topic, not by the supervisor. ``tend`` starts crashed processes again, faster with
reserves (``provide``); ``telling`` reports every end at once.
"""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from types import TracebackType

from flexarm_bringup.installed import find_executable
from flexarm_bringup.processes.child import Child, start_child
from flexarm_bringup.processes.composition import node_names, process_arguments
from flexarm_bringup.processes.end_watch import EndWatch
from flexarm_bringup.processes.graph import Process
from flexarm_bringup.processes.reserves import Reserves
from flexarm_bringup.processes.surroundings import defaults, of_life
from flexarm_model.process.kept import begin
from flexarm_model.process.reserve import MARK
from flexarm_model.process.start_watch import EXIT_STUCK

GRACE = ((signal.SIGINT, 5.0), (signal.SIGTERM, 2.0), (signal.SIGKILL, 2.0))  # s for all children together
POLL_PERIOD = 0.01  # s
RESPAWNS, WITHIN = 3, 30.0  # a process that crashes more often within so many seconds stays away
ON_PURPOSE = (0, 2, 3)  # exit codes: asked to end, wrong configuration, name taken: it would end again
_REEXECUTED = ("_ROS_WHEELS_BOOTSTRAP_COMPLETE",)  # marks of the parent's interpreter, not of the child's


@dataclass(frozen=True)
class Ending:
    """A process that has ended.

    Attributes:
        process: Its row of the graph.
        code: Exit code; minus the signal that ended it.
        last_words: Last line of its log; of one that hung while it started, that.
        returns: It has been started again.
    """

    process: Process
    code: int
    last_words: str
    returns: bool

    def __str__(self) -> str:
        """Return one line about it."""
        again = ", started again" if self.returns else ""
        return f"{self.process.name} ended with {self.code}{again}: {self.last_words}"


class Supervisor:
    """Runs processes until told to stop; use it with ``with``."""

    def __init__(
        self,
        processes: Sequence[Process],
        log_folder: Path,
        environment: Mapping[str, str] = os.environ,
        command: Callable[[Process], list[str]] | None = None,
    ) -> None:
        """Start all processes. Call it from the main thread, which must outlive the children.

        Args:
            processes: What to start, in this order.
            log_folder: Gets ``<name>.log`` with stdout and stderr of each, and for the time of this run a
                folder with what its nodes keep over crashes.
            environment: Of the children; see ``surroundings`` for what holds where it says nothing.
            command: Makes the command line of a process; None: the installed executable.

        Raises:
            FileNotFoundError: An executable is not installed; nothing keeps running.
        """
        kept = {key: value for key, value in environment.items() if key not in _REEXECUTED}
        self.environment = {**defaults(kept), **kept}
        self._processes = {process.name: process for process in processes}
        self._children: dict[str, Child] = {}
        self._log_folder = log_folder
        log_folder.mkdir(parents=True, exist_ok=True)
        self._kept = TemporaryDirectory(prefix="kept_", dir=log_folder, ignore_cleanup_errors=True)
        self.environment |= begin(Path(self._kept.name))
        self._command = command or self._installed
        self._crashes: dict[str, list[float]] = {process.name: [] for process in processes}
        self._told: set[str] = set()
        self._ends: EndWatch | None = None
        self._reserves = Reserves(self._start_reserve)
        try:
            for process in processes:
                self.log(process.name).write_bytes(b"")
                self._children[process.name] = self._start(process)
        except BaseException:
            self.stop()
            raise

    @property
    def pids(self) -> dict[str, int]:
        """Process number by name."""
        return {name: child.pid for name, child in self._children.items()}

    @property
    def nodes(self) -> tuple[str, ...]:
        """Names of the nodes in all processes."""
        return node_names(tuple(self._processes.values()))

    def log(self, name: str) -> Path:
        """Return the log file of a process."""
        return self._log_folder / f"{name}.log"

    def exit_codes(self) -> dict[str, int]:
        """Return the exit code of every process that has ended; minus the signal that ended it."""
        codes = {name: child.poll() for name, child in self._children.items()}
        return {name: code for name, code in codes.items() if code is not None}

    def failed(self) -> str:
        """Return one line about the first essential process that has ended; empty when all run."""
        for name, code in self.exit_codes().items():
            if self._processes[name].essential:
                return f"{name} ended with {code}: {self._last_words(name, code)}"
        return ""

    @contextmanager
    def telling(self, tell: Callable[[Process], None]) -> Iterator[None]:
        """Tell at once of every process that ends meanwhile, in a thread of its own."""
        self._ends = EndWatch(lambda name: tell(self._processes[name]))
        for name in self._children:
            self._watch_end(name)
        try:
            yield
        finally:
            self._ends.close()
            self._ends = None

    def tend(self) -> list[Ending]:
        """Start crashed processes again, those that shall be; return what has ended since the last call."""
        endings = []
        for name, code in self.exit_codes().items():
            if name not in self._told:
                process, words = self._processes[name], self._last_words(name, code)
                returns = self._may_return(process, code)
                if not returns and process.respawn and code not in ON_PURPOSE:
                    words = f"{words}; not started again: {RESPAWNS} times in {WITHIN:g} s at most"
                try:
                    if returns:
                        self._bring_back(process)
                except OSError as error:  # its package is just being built, say
                    returns, words = False, f"{words}; it cannot be started again: {error}"
                if not returns:
                    self._told.add(name)
                endings.append(Ending(process, code, words, returns))
        return endings

    def provide(self) -> bool:
        """Have reserves loaded, one after the other; return whether all are there. Call it while all is well.

        Those get one without whom motion stops and who are started again.
        """
        missed = [row for row in self._processes.values() if row.essential and row.respawn]
        return self._reserves.provide([row for row in missed if row.name not in self._told])

    def wait(self, seconds: float) -> bool:
        """Wait until every process has ended, at most ``seconds``; return whether all have."""
        deadline = time.monotonic() + seconds
        while len(self.exit_codes()) < len(self._children):
            if time.monotonic() >= deadline:
                return False
            time.sleep(POLL_PERIOD)
        return True

    def stop(self, grace: Sequence[tuple[int, float]] = GRACE) -> dict[str, int]:
        """Stop what still runs and return all exit codes.

        Args:
            grace: Signals in order, each with the time to wait after it [s].
        """
        self._reserves.end()
        for number, seconds in grace:
            for child in self._children.values():
                child.signal(number)
            if self.wait(seconds):
                break
        for child in self._children.values():
            child.line.close()
        self._kept.cleanup()
        return self.exit_codes()

    def __enter__(self) -> Supervisor:
        """Return the supervisor itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop everything."""
        self.stop()

    def _installed(self, process: Process) -> list[str]:
        path = find_executable(process.package, process.executable, self.environment)
        return [str(path), *process_arguments(process, self._log_folder)]

    def _may_return(self, process: Process, code: int) -> bool:
        if not process.respawn or code in ON_PURPOSE:
            return False
        now, crashes = time.monotonic(), self._crashes[process.name]
        crashes.append(now)
        return sum(now - at < WITHIN for at in crashes) <= RESPAWNS

    def _start(self, process: Process) -> Child:
        return self._open(process, of_life(len(self._crashes[process.name])))

    def _start_reserve(self, process: Process) -> Child:
        life = of_life(len(self._crashes[process.name]) + 1)
        return self._open(process, {**life, MARK: "1"})

    def _open(self, process: Process, own: Mapping[str, str]) -> Child:
        return start_child(self._command(process), {**self.environment, **own}, self.log(process.name))

    def _bring_back(self, process: Process) -> None:
        fresh = self._reserves.call(process.name) or self._start(process)
        self._children[process.name].line.close()
        self._children[process.name] = fresh
        self._watch_end(process.name)

    def _watch_end(self, name: str) -> None:
        if self._ends is not None:
            self._ends.add(name, self._children[name])

    def _last_words(self, name: str, code: int) -> str:
        if code == EXIT_STUCK:
            return f"it hung while it started; {self.log(name)} says where"
        lines = self.log(name).read_text(encoding="utf8", errors="replace").split("\n")
        return next((line for line in reversed(lines) if line.strip()), "it said nothing")
