"""An arm that does the moves of a task again and again, with other settings and other noise each time."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flexarm_bringup.closed_loop import run_loop
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.plant import Plant
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.sim_run.study import loop_settings, lost_state, observe_tip
from flexarm_bringup.static_arm import StaticArm
from flexarm_bringup.tasks.course import plan_course
from flexarm_bringup.tasks.task import Task
from flexarm_bringup.tip_vibration import Residual, read_residual
from flexarm_controller.settings import MpcConfig
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.manipulator.start_pose import starting_at
from flexarm_model.tree.reduced_tree import ReducedTree

Settings = tuple[EstimatorConfig, MpcConfig]


@dataclass(frozen=True)
class Outcome:
    """What became of the moves.

    Attributes:
        residuals: After each move.
        tracking: Largest distance of the tip from where the reference wants it [m].
        stopped: Why the guard stopped the arm, or a state that was lost; empty when all went well.
    """

    residuals: tuple[Residual, ...]
    tracking: float
    stopped: str

    @property
    def residual(self) -> Residual:
        """All moves together: RMS accelerations and distances, longest settling."""
        return together(self.residuals)


class Bench:
    """A simulated arm, and what estimator and controller believe of it. Every run is a cold start."""

    def __init__(
        self, known: ManipulatorConfig, task: Task, real: ManipulatorConfig, rig: RigSettings | None = None
    ) -> None:
        """Work out the moves.

        Args:
            known: The description that estimator and controller have.
            task: The moves.
            real: What the rig is made of.
            rig: Noise, and what else differs on the rig.

        Raises:
            ValueError: The arm cannot do the moves.
        """
        self._course = plan_course(StaticArm(ReducedTree(known)), task, 1 / known.rate_hz)
        self._tree = ReducedTree(starting_at(known, self._course.home))
        self._real, self._rig = starting_at(real, self._course.home), rig or RigSettings()
        self._task = task
        self._plant: Plant | None = None

    def run(self, settings: Settings, seed: int) -> Outcome:
        """Do the moves.

        Args:
            settings: Of estimator and law.
            seed: Of all noise.

        Raises:
            ValueError: The arm cannot follow the moves.
            LinAlgError: No law comes of these settings.
        """
        plain = loop_settings(self._task, "mpc", replace(self._rig, seed=seed))
        loop = replace(plain, estimator=settings[0], mpc=replace(settings[1], time_limit=0.0))
        hardware = Hardware(self._real, loop.rig, plant=self._plant)
        self._plant, course = hardware.rig.plant, self._course
        ticks, effort = run_loop(hardware, self._tree, course.reference, course.end, loop, observe_tip)
        t, tip = (np.array([tick[name] for tick in ticks]) for name in ("t", "tip"))
        left = tuple(read_residual(t, tip, leg.start, leg.end, self._task.watch) for leg in course.legs)
        moving = (t >= course.legs[0].start) & (t <= course.legs[-1].end)
        tracking = np.linalg.norm(tip - course.tip_at(t), axis=1)[moving].max()
        return Outcome(left, float(tracking), effort.guard or lost_state(effort))


def together(left: tuple[Residual, ...]) -> Residual:
    """Return what is left of several moves: RMS accelerations and distances, longest settling."""
    acceleration, distance = (
        float(np.sqrt(np.mean([value**2 for value in values])))
        for values in ([one.acceleration for one in left], [one.distance for one in left])
    )
    settling, growth = max(one.settling for one in left), max(one.growth for one in left)
    return Residual(acceleration, distance, settling, growth)
