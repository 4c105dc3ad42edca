"""The closed loop of a manipulator at many poses: its named ones, and some along its moves."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.margins.loop import Loop
from flexarm_bringup.margins.poses import Poses
from flexarm_bringup.tasks.task import Task
from flexarm_controller.margins.case import Case
from flexarm_controller.margins.short_law import ShortCase
from flexarm_controller.margins.verdict import unread
from flexarm_controller.settings import ControllerConfig, MarginConfig, MpcConfig
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.settled import settled_filter
from flexarm_model.bodies.model_order import bodies_without_more
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.settings.parameters import ParameterError
from flexarm_model.settings.strict_yaml import ConfigError
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
Unjudged = list[tuple[str, str]]  # label of a pose, and why


@dataclass(frozen=True)
class PoseResult:
    """What was found at a pose.

    Attributes:
        label: Its name, or when the moves come by.
        locked_hz: Frequencies of the served modes, axes locked, as described [Hz].
        cases: One per frequency error.
        firm: The same of a law that is firm for a short time; none without one.
    """

    label: str
    locked_hz: tuple[float, ...]
    cases: tuple[Case, ...]
    firm: tuple[ShortCase, ...] = ()


@dataclass(frozen=True)
class Study:
    """Everything that was found of one preset.

    Attributes:
        task: Settings of estimator and controller are its.
        preset: Of the description.
        dt: Control period [s].
        served: Modes that the controller knows.
        left_out: Sensors that the settled filter does without.
        poses: In the order looked at.
        out_of_reach: Poses of the grid that the arm cannot take, and why.
        unjudged: Those, named or not, at which there is no law or no answer of it, and why.
        unread: Which motors have no encoder, to be said after what falls short.
        no_more: Flexible bodies that are closed with the modes described.
    """

    task: Task
    preset: str
    dt: float
    served: tuple[str, ...]
    left_out: tuple[str, ...]
    poses: tuple[PoseResult, ...]
    out_of_reach: tuple[tuple[str, str], ...] = ()
    unjudged: tuple[tuple[str, str], ...] = ()
    unread: str = ""
    no_more: tuple[str, ...] = ()

    @property
    def cases(self) -> list[Case]:
        """All cases of all poses."""
        return [case for pose in self.poses for case in pose.cases]


def run_study(
    task: Task, preset: str, poses: Poses, margins: MarginConfig, say: Callable[[str], None]
) -> Study:
    """Look at every pose.

    Args:
        task: Of the manipulator.
        preset: Of its description.
        poses: At which.
        margins: What is wanted.
        say: Is told what comes next.

    Raises:
        ConfigError: Preset or description are wrong.
        ValueError: The arm cannot do its moves, or home has no model.
    """
    config, task = load_config(find_manipulator(task.manipulator), preset), task.under(preset)
    laws = task.make("controller", ControllerConfig), task.make("mpc", MpcConfig)
    loop = Loop(config, task.make("estimator", EstimatorConfig), laws, margins)
    grid = poses.of_grid(config)
    found, unjudged = _judged(
        loop, poses.asked(loop.tree, task, loop.dt), lambda k, label: say(f"pose {label}")
    )
    within, out_of_reach = _within_reach(loop.tree, grid)
    of_grid = _judged(loop, within, lambda k, label: say(f"grid, pose {k} of {len(within)}: {label}"))
    estimator = loop.estimator()
    left_out = settled_filter(estimator, loop.dt).left_out
    served = estimator.model.eta_names
    poses_left = tuple(out_of_reach), (*unjudged, *of_grid[1])
    said = unread(config), tuple(bodies_without_more(config))
    return Study(task, preset, loop.dt, served, left_out, (*found, *of_grid[0]), *poses_left, *said)


def _within_reach(tree: ReducedTree, poses: Mapping[str, Array]) -> tuple[dict[str, Array], Unjudged]:
    """Return those poses that the arm can take, by label, and the others with the reason."""
    within, beyond = {}, []
    for label, pose in poses.items():
        try:
            linearize(tree, pose)
            within[label] = pose
        except ValueError as error:
            beyond.append((label, str(error)))
    return within, beyond


def _judged(
    loop: Loop, poses: Mapping[str, Array], say: Callable[[int, str], None]
) -> tuple[list[PoseResult], Unjudged]:
    """Return what was found at every pose, and why nothing was at the others: one must not hide the rest."""
    found, unjudged = [], []
    for k, (label, pose) in enumerate(poses.items(), start=1):
        say(k, label)
        try:
            found.append(_look(loop, label, pose))
        except (ConfigError, ParameterError):  # of the settings, not of the pose
            raise
        except (ValueError, np.linalg.LinAlgError) as error:
            unjudged.append((label, str(error)))
    return found, unjudged


def _look(loop: Loop, label: str, pose: Array) -> PoseResult:
    locked = tuple(linearize(loop.tree, pose).omega / (2.0 * np.pi))
    look = loop.look(pose)
    return PoseResult(label, locked, tuple(look.cases), tuple(look.firm))


def worst_of(cases: Sequence[Case], name: str) -> tuple[Case, Case] | None:
    """Return the cases with the smallest gain and delay margin of a path; None where none is stable."""
    having = [case for case in cases if has_path(case, name)]
    if not having:
        return None
    by_gain = min(having, key=lambda case: case.margin(name).gain.decibels)
    return by_gain, min(having, key=lambda case: case.margin(name).delay)


def has_path(case: Case, name: str) -> bool:
    """Say whether a case has margins of a path; one of an unstable loop has none."""
    return any(margin.name == name for margin in case.margins)
