"""One soak: a graph of processes, a script of what happens to it, and its outcome."""

from __future__ import annotations

import os
import time
from collections import Counter, defaultdict
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import rclpy
from rclpy.signals import SignalHandlerOptions

from flexarm_bringup.processes.graph import Process
from flexarm_bringup.processes.standstill import Witnesses
from flexarm_bringup.processes.supervisor import Supervisor
from flexarm_bringup.soak.killed import Killed
from flexarm_bringup.soak.memory import PERIOD, MemoryLog
from flexarm_bringup.soak.outcome import Outcome
from flexarm_bringup.soak.script import Script, move, random_fault, random_goal
from flexarm_bringup.soak.sent_move import SentMove, is_refused
from flexarm_bringup.soak.soak_node import SoakNode, start_of
from flexarm_bringup.soak.worst import Moment, WorstMoments
from flexarm_model.manipulator.description import ManipulatorConfig

PATIENCE = 120.0  # s until everything is ready for the first time, and after every kill
STEP = 0.02  # s between two looks
ARM_PERIOD = 0.5  # s between two attempts
LEAD = 2.0  # s before a move, for the models on its way


@dataclass(frozen=True)
class SoakJob:
    """What is to be done.

    Attributes:
        graph: Processes.
        config: The manipulator.
        seconds: How long [s].
        warm_up: After the start of a process its memory is not judged so long [s].
        seed: Of everything that is drawn.
        fault_every, kill_every: Means between events [s]; 0 for never.
    """

    graph: tuple[Process, ...]
    config: ManipulatorConfig
    seconds: float
    warm_up: float
    seed: int
    fault_every: float
    kill_every: float


def soak(job: SoakJob, log: Path, say: Callable[[str], None], asked_to_end: Callable[[], bool]) -> Outcome:
    """Run in the domain of this process's environment.

    Args:
        job: What to do.
        log: Folder of the log files.
        say: Told how far it is.
        asked_to_end: Whether somebody wants it to end before its time.
    """
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)  # the caller notes Ctrl-C
    node = SoakNode([row.name for row in job.graph])
    try:
        with Witnesses() as witnesses, Supervisor(job.graph, log, os.environ) as supervisor:
            outcome = _Run(job, node, supervisor, say).outcome(asked_to_end)
        return replace(outcome, witnesses=witnesses)
    finally:
        node.close()
        rclpy.try_shutdown()


class _Run:
    """A soak on its way."""

    def __init__(
        self, job: SoakJob, node: SoakNode, supervisor: Supervisor, say: Callable[[str], None]
    ) -> None:
        self._job, self._node, self._supervisor, self._say = job, node, supervisor, say
        self._script = Script(job.seed, job.fault_every, job.kill_every)
        self._memory, self._counts = MemoryLog(), Counter[str]()
        self._killed = Killed()
        self._tip_errors: defaultdict[str, list[float]] = defaultdict(list)
        self._worst, self._fault = WorstMoments(), "none yet"
        self._sent: SentMove | None = None
        self._began = self._looked = self._asked = self._ready_at = time.monotonic()
        self._failure = ""

    def outcome(self, asked_to_end: Callable[[], bool]) -> Outcome:
        """Do everything, or all until somebody wants it to end, and return what it has shown."""
        if self._wait_until_ready(asked_to_end):
            self._node.late.begin()  # who starts is late
            self._began = time.monotonic()
            while self._t < self._job.seconds and not self._failure:
                self._node.spin(STEP)
                self._look()
                self._act()
                if asked_to_end() and not self._failure:
                    self._failure = f"interrupted after {self._t:.0f} s"
        return Outcome(
            f"{self._job.config.name} {self._job.config.preset}".strip(),
            self._began,
            self._t,
            self._job.warm_up,
            self._memory.lives,
            self._node.late.cycles,
            self._node.late,
            dict(self._counts),
            dict(self._node.stops),
            self._tip_errors,
            dict(self._node.errors),
            self._failure,
            own_ends=dict(self._killed.own_ends),
            worst=self._worst.worst,
        )

    @property
    def _t(self) -> float:
        return time.monotonic() - self._began

    @property
    def _waiting(self) -> str:
        return ", ".join(name for name, is_ready in self._node.ready.items() if not is_ready)

    def _wait_until_ready(self, asked_to_end: Callable[[], bool]) -> bool:
        while not all(self._node.ready.values()):
            self._node.spin(STEP)
            self._say(f"waiting for {self._waiting}")
            self._tend()
            if asked_to_end():
                self._failure = f"interrupted while it waited for {self._waiting}"
            elif self._t > PATIENCE:
                self._failure = f"waited {PATIENCE:g} s for {self._waiting}"
            if self._failure:
                return False
        return True

    def _look(self) -> None:
        """Keep memory and tip error; see to processes that have ended."""
        self._tend()
        look = self._node.tip()
        if look is not None:
            doing = self._doing(look.stamp_ns)
            self._tip_errors[doing if look.is_usable else f"{doing}, state not to be used"].append(look.error)
            self._worst.note(Moment(self._t, look.error, doing, look.is_usable, look.said, self._fault))
        now = time.monotonic()
        if now - self._looked >= PERIOD:
            self._looked = now
            self._memory.look(self._t, self._supervisor.pids)
            self._tell()

    def _doing(self, stamp_ns: int) -> str:
        if not self._node.is_armed:
            return "stopped"
        is_moving = self._sent is not None and self._sent.moves(stamp_ns, self._node.answer)
        return "moving" if is_moving else "standing"

    def _act(self) -> None:
        """Let happen what is due; arm and move when that is possible."""
        is_ready, now = all(self._node.ready.values()), time.monotonic()
        for event in self._script.due(self._t):
            self._break(event, is_ready)
        if is_ready:
            self._ready_at = now
        elif now - self._ready_at > PATIENCE:
            self._failure = f"{self._waiting} did not come back in {PATIENCE:g} s"
        if self._node.is_armed and (self._sent is None or self._sent.is_over(self._node.now_ns)):
            self._move_on()
        elif not self._node.is_armed:
            self._sent = None
            if is_ready and now - self._asked > ARM_PERIOD:
                self._asked = now
                self._node.try_to_arm()

    def _break(self, event: str, is_ready: bool) -> None:
        """Break a sensor, or kill a process while all are there."""
        if event == "fault":
            fault = random_fault(self._script.rng, self._job.config.sensors)
            self._node.break_sensor(fault)
            self._fault = f"{fault}, from {self._t:.2f} s on"
            self._counts["faults of sensors"] += 1
        elif is_ready:
            victim = self._script.victim()
            self._killed.kill(victim, self._supervisor.pids[victim])
            self._counts[f"{victim} killed"] += 1

    def _move_on(self) -> None:
        """Count the move that has ended and send the next."""
        node, rng, config = self._node, self._script.rng, self._job.config
        was_refused = is_refused(node.answer)
        if self._sent is not None:
            self._counts["moves refused" if was_refused else "moves done"] += 1
        start = node.pose() if self._sent is None or was_refused else self._sent.goal
        self._sent = None
        if start is None:
            return
        reference = move(rng, start, random_goal(rng, config), config)
        zero_ns = start_of(node, LEAD)
        node.send(reference, tuple(config.actuated), zero_ns)
        self._sent = SentMove.of(reference, zero_ns)

    def _tend(self) -> None:
        if not self._waiting:
            self._supervisor.provide()
        for ending in self._supervisor.tend():
            self._node.on_ending(ending.process.name)
            self._killed.note(ending)
            if not ending.returns:
                self._failure = str(ending)

    def _tell(self) -> None:
        counts, late = self._counts, self._node.late.total
        killed = sum(count for name, count in counts.items() if name.endswith("killed"))
        grown = {life.name: life.growth(self._job.warm_up) for life in self._memory.lives}
        known = {name: value for name, value in grown.items() if value is not None}
        most = max(known, key=lambda name: known[name], default="")
        memory = f", {most} {known[most]:+.1f} MB" if most else ""
        self._say(
            f"soaking: {self._t:.0f} of {self._job.seconds:.0f} s, {counts['moves done']} moves, "
            f"{sum(self._node.stops.values())} stops, {killed} killed, {late} late{memory}"
        )
