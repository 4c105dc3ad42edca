"""Before and after on the simulated rig: old description and settings against new ones, on the same arm."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.closed_loop import LoopSettings, run_loop
from flexarm_bringup.margins.study import Loop, worst_of
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.sim_run.study import loop_settings, observe_tip
from flexarm_bringup.static_arm import StaticArm
from flexarm_bringup.tasks.course import plan_course
from flexarm_bringup.tasks.task import Task
from flexarm_bringup.tip_vibration import Residual, read_residual
from flexarm_controller.settings import MpcConfig
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.description import ManipulatorConfig
from flexarm_model.reduced_tree import ReducedTree

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Trial:
    """What a description with its settings is worth on an arm.

    Attributes:
        residual: Of all moves together: RMS accelerations and distances, longest settling.
        tracking: Largest distance of the tip from where the reference wants it [m].
        guard: Why the guard stopped the arm; empty when it did not.
        margins: Smallest gain [dB] and delay [s] margin of every path, as this description has the arm.
        trouble: What of the margins falls short; empty when nothing does.
    """

    residual: Residual
    tracking: float
    guard: str
    margins: Mapping[str, tuple[float, float]]
    trouble: str


def run_trial(
    known: ManipulatorConfig,
    settings: tuple[EstimatorConfig, MpcConfig],
    task: Task,
    real: ManipulatorConfig,
    rig: RigSettings | None = None,
) -> Trial:
    """Let an arm do its moves.

    Args:
        known: The description that estimator and controller have.
        settings: Theirs.
        task: The moves.
        real: What the rig is made of.
        rig: Noise, and what else differs on the rig.

    Raises:
        ValueError: The arm cannot do the moves.
    """
    tree = ReducedTree(known)
    course = plan_course(StaticArm(tree), task, 1 / known.rate_hz)
    tree = ReducedTree(replace(known, home=course.home))
    plain = loop_settings(task, "mpc", rig or RigSettings())
    loop = replace(plain, estimator=settings[0], mpc=replace(settings[1], time_limit=0.0))
    hardware = Hardware(replace(real, home=course.home), loop.rig)
    ticks, effort = run_loop(hardware, tree, course.reference, course.end, loop, observe_tip)
    t, tip = (np.array([tick[name] for tick in ticks]) for name in ("t", "tip"))
    left = [read_residual(t, tip, leg.end, task.watch) for leg in course.legs]
    moving = (t >= course.legs[0].start) & (t <= course.legs[-1].end)
    tracking = np.linalg.norm(tip - course.tip_at(t), axis=1)[moving].max()
    margins, trouble = _margins(known, loop)
    return Trial(_together(left), float(tracking), effort.guard, margins, trouble)


def _together(left: list[Residual]) -> Residual:
    acceleration, distance = (
        float(np.sqrt(np.mean([value**2 for value in values])))
        for values in ([one.acceleration for one in left], [one.distance for one in left])
    )
    settling, growth = max(one.settling for one in left), max(one.growth for one in left)
    return Residual(acceleration, distance, settling, growth)


def _margins(known: ManipulatorConfig, settings: LoopSettings) -> tuple[dict[str, tuple[float, float]], str]:
    loop = Loop(known, settings.estimator, (settings.controller, settings.mpc))
    cases = loop.cases()
    names = dict.fromkeys(margin.name for case in cases for margin in case.margins)
    worst = {name: worst_of(cases, name) for name in names}
    found = {
        name: (pair[0].margin(name).gain.decibels, pair[1].margin(name).delay)
        for name, pair in worst.items()
        if pair is not None
    }
    return found, loop.judge()
