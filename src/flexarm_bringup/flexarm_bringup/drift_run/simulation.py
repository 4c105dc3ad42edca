"""The watch beside the whole chain on the simulated rig, whose frequencies may change on the way.

Frequencies change by the stiffness of everything elastic: the plant is replaced by a softer one that goes on
from the same shape with the same velocity.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.closed_loop import run_loop
from flexarm_bringup.drift_run.drives_alone import drive_alone
from flexarm_bringup.drift_run.normal_moves import normal_moves
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.plant import Plant
from flexarm_bringup.sim.rig import Rig, RigSettings
from flexarm_bringup.sim.sample import Sample
from flexarm_bringup.sim_run.study import loop_settings
from flexarm_bringup.static_arm import StaticArm
from flexarm_bringup.tasks.task import Task
from flexarm_estimator.drift.drift_watch import DriftWatch
from flexarm_estimator.drift.judgement import ModeNow
from flexarm_estimator.drift.settings import DriftConfig
from flexarm_estimator.estimate import Estimate
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.manipulator.start_pose import starting_at
from flexarm_model.served.linearize import linearize
from flexarm_model.served.model_schedule import ModelSchedule, ScheduleSettings, periods_between_looks
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
ALONE = "alone"
EVERY = 0.5  # s between two rows of the record


@dataclass(frozen=True)
class Drill:
    """What happens to the arm.

    Attributes:
        duration: Of the moves [s].
        scale: Real over described frequencies from ``at`` on [1].
        at: When they change [s].
        seed: Of noise and pace.
        law: That moves it; "alone" is joint PD on the drives, see ``drives_alone``.
    """

    duration: float
    scale: float = 1.0
    at: float = 0.0
    seed: int = 1
    law: str = "mpc"


@dataclass(frozen=True)
class Watched:
    """What the watch said.

    Attributes:
        t: Times of the rows [s], (k,).
        modes: The modes then.
        alarms: When a mode was told to have drifted [s], with the sentence; one entry per beginning.
        guard: Why the guard stopped the arm; empty when it did not.
        proposal: At the end.
        told: The modes of the alarms as they read when they were told.
        sensors: When it was told which sensors are left out or doubted [s], with the sentence; an empty one
            when none is any more.
        judged: By whom the sensors were judged, where no estimator did when they spoke.
    """

    t: Array
    modes: tuple[tuple[ModeNow, ...], ...]
    alarms: tuple[tuple[float, str], ...]
    guard: str
    proposal: str
    told: tuple[ModeNow, ...] = ()
    sensors: tuple[tuple[float, str], ...] = ()
    judged: str = ""


class _Listening(Hardware):
    """Hardware that keeps what its sensors said last."""

    heard: list[Sample] = []

    def advance(self) -> list[Sample]:
        """Move by one period; return what the sensors deliver, and keep it."""
        self.heard = super().advance()
        return self.heard


def run_drill(
    config: ManipulatorConfig,
    task: Task,
    drill: Drill,
    settings: DriftConfig | None = None,
    say: Callable[[str], None] = lambda text: None,
) -> Watched:
    """Let the arm move under estimator and controller with the watch beside them.

    Args:
        config: The manipulator as described.
        task: Its moves and settings.
        drill: What happens.
        settings: Of the watch; None: the task's.
        say: Is told how far it is.

    Raises:
        ValueError: The arm cannot do the moves, or has no mode to watch.
    """
    tree, dt = ReducedTree(config), 1.0 / config.rate_hz
    home, reference = normal_moves(StaticArm(tree), task, dt, drill.duration, drill.seed)
    config = starting_at(config, home)
    tree = ReducedTree(config)
    estimator, served = task.make("estimator", EstimatorConfig), task.make("schedule", ScheduleSettings)
    watched = settings or task.make("drift", DriftConfig)
    watch = DriftWatch(linearize(tree), tree, config.sensors, (estimator, watched), dt)
    rig, end = RigSettings(seed=drill.seed), float(reference.t[-1])
    changed = Rig(config, replace(rig, frequency_scale=drill.scale)).plant
    looker = _Looker(watch, ModelSchedule(tree, config, reference, served), drill, changed, say)
    if drill.law == ALONE:
        drive_alone(Rig(config, rig), watch.model, reference, end, looker.hear)
        return looker.said("")
    loop = loop_settings(task, drill.law, rig)
    _, effort = run_loop(_Listening(config, rig), tree, reference, end, loop, looker.look)
    return looker.said(effort.guard)


class _Looker:
    """Feeds the watch from the loop's rows, and changes the plant when it is time."""

    def __init__(
        self,
        watch: DriftWatch,
        schedule: ModelSchedule,
        drill: Drill,
        changed: Plant,
        say: Callable[[str], None],
    ) -> None:
        self._watch, self._schedule, self._drill, self._changed, self._say = (
            watch,
            schedule,
            drill,
            changed,
            say,
        )
        self._t: list[float] = []
        self._modes: list[tuple[ModeNow, ...]] = []
        self._alarms: list[tuple[float, str]] = []
        self._told: set[str] = set()
        self._drifted: list[ModeNow] = []

    def look(self, hardware: Hardware, estimate: Estimate) -> Mapping[str, Array]:
        """Take a tick of the closed loop; nothing of it is recorded."""
        assert isinstance(hardware, _Listening)
        self.hear(hardware.rig, hardware.heard, np.array(hardware.acted))
        return {}

    def hear(self, rig: Rig, samples: Sequence[Sample], tau: Array) -> None:
        """Take what was sampled and what acted until the rig's tick."""
        t = rig.time_of(rig.tick)
        if self._drill.scale != 1.0 and rig.plant is not self._changed and t >= self._drill.at:
            self._changed.q, self._changed.v, self._changed.a = rig.plant.q, rig.plant.v, rig.plant.a
            rig.plant = self._changed
        if not rig.tick % periods_between_looks(rig.dt):
            model = self._schedule.next(self._watch.model, t)
            if model is not None:
                self._watch.adopt(model)
        self._watch.step(rig.tick, {s.sensor: s.y for s in samples if s.tick == rig.tick}, tau)
        self._note(t, rig.tick % round(EVERY / rig.dt) == 0)

    def _note(self, t: float, is_row: bool) -> None:
        for name, text in self._watch.alarms.items():
            if name not in self._told:
                self._alarms.append((t, text))
                self._drifted += [mode for mode in self._watch.modes if mode.name == name]
        self._told = set(self._watch.alarms)
        if is_row:
            self._t.append(t)
            self._modes.append(self._watch.modes)
            self._say(f"moving: {t:.0f} of {self._drill.duration:.0f} s")

    def said(self, guard: str) -> Watched:
        """Return what the watch told; ``guard`` is why the guard stopped the arm, empty when it did not."""
        return Watched(
            np.array(self._t),
            tuple(self._modes),
            tuple(self._alarms),
            guard,
            self._watch.proposal,
            tuple(self._drifted),
        )
