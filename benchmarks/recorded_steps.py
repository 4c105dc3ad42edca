"""What a controller was asked in closed-loop runs with scarce torque, to be asked again of any solver.

A run is the moves of a machine (config/moves) on the simulated rig with its noise, estimator and guard,
seeded. A first run finds the torque the moves want; for the second every axis is left ``SHARE`` of what it
wants beyond its usual load, so that torque and its rate bind in a part of the steps. Recorded are the
inputs of every step of the predictive law; models follow the pose as they do in ``flexarm sim``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any
from unittest import mock

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.closed_loop import LoopSettings, run_loop
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.sim_run.study import loop_settings
from flexarm_bringup.static_arm import StaticArm
from flexarm_bringup.tasks.course import plan_course
from flexarm_bringup.tasks.task import Task
from flexarm_bringup.tasks.task_for import task_for
from flexarm_controller.guard_settings import GuardSettings, guard_limits
from flexarm_controller.laws import LAWS, LawInputs
from flexarm_controller.limits import Limits
from flexarm_controller.mpc import Mpc, Plan
from flexarm_controller.reference import Reference
from flexarm_controller.settings import MpcConfig
from flexarm_controller.state import ArmState
from flexarm_estimator.estimate import Estimate
from flexarm_model.manipulator.description import Axis, Joint, ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
SHARE = 0.5  # of the torque beyond an axis's usual load
RATE = 100.0  # torque limits per second that the torque may change by [1/s]
USUAL = 50.0  # percentile of the torque that counts as usual load: gravity, where there is any


@dataclass(frozen=True)
class Asked:
    """Inputs of one step: index of the model, and what the law was given."""

    model: int
    state: ArmState
    sent: Array


@dataclass
class Recording:
    """A run.

    Attributes:
        name: Of the machine.
        config: Weights, horizon, solver.
        dt: Control period [s].
        limits: Of the arm in this run.
        reference: What was followed.
        models: Served on the way, in order.
        asked: Inputs of every step.
    """

    name: str
    config: MpcConfig
    dt: float
    reference: Reference
    limits: Limits | None = None
    models: list[ReducedModel] = field(default_factory=list)
    asked: list[Asked] = field(default_factory=list)


@dataclass(frozen=True)
class Vectors:
    """What the program of a step depends on.

    Attributes:
        p_now: What is known but the reference, (n_now,).
        reference: Its samples, (3 n_u (N + 1),).
    """

    p_now: Array
    reference: Array


def vectors_of(recording: Recording) -> list[Vectors]:
    """Return what each step's program depends on."""
    config, dt, limits = recording.config, recording.dt, recording.limits
    assert limits is not None
    laws = [Mpc(model, limits, config, dt) for model in recording.models]
    grid: Array = dt * np.arange(config.horizon + 1.0)
    found = []
    for asked in recording.asked:
        law = laws[asked.model]
        samples = np.hstack(recording.reference.sample(asked.state.t + law.lead + grid))
        found.append(Vectors(law.known_now(asked.state, asked.sent).copy(), samples.ravel()))
    return found


class RecordingLaw:
    """The predictive law, which notes what it is asked."""

    def __init__(self, recording: Recording, model: ReducedModel, given: LawInputs) -> None:
        """Build the law for ``model``."""
        self._recording, self._index = recording, len(recording.models)
        recording.models.append(model)
        recording.limits = given.limits
        self._mpc = Mpc(model, given.limits, given.mpc, given.config.period)

    def step(self, state: ArmState, reference: Reference, sent: Array) -> Plan:
        """Plan; see ``Planner``."""
        self._recording.asked.append(Asked(self._index, state, sent.copy()))
        return self._mpc.step(state, reference, sent)

    def work_ahead(self) -> None:
        """Nothing to do; see ``Planner``."""


def record(
    name: str, changes: Mapping[str, Any] | None = None, seconds: float = np.inf, modes: int = 0
) -> Recording:
    """Run the moves of a machine twice and return what its controller was asked the second time.

    Args:
        name: Of the machine.
        changes: Of its predictive controller's settings.
        seconds: After which to stop [s].
        modes: Served modes; 0 for those of its description.
    """
    task = task_for(name)
    task = replace(
        task, settings={**task.settings, "mpc": {**task.settings.get("mpc", {}), **(changes or {})}}
    )
    config = load_config(find_manipulator(name), task.presets[0])
    config = replace(config, modes=modes or config.modes)
    wanted = _torques(config, task, seconds)
    usual = np.percentile(wanted, USUAL, axis=0)
    effort = usual + SHARE * (wanted.max(axis=0) - usual)
    scarce = with_efforts(config, dict(zip(config.actuated, effort, strict=True)))
    return _run(scarce, task, seconds, config)[0]


def with_efforts(config: ManipulatorConfig, efforts: Mapping[str, float]) -> ManipulatorConfig:
    """Return the description with other torque limits of its actuated axes."""

    def axis_of(joint: Joint, axis: Axis) -> Axis:
        effort = efforts.get(f"{joint.name}.{axis.name}")
        return axis if effort is None else replace(axis, effort=effort, effort_rate=RATE * effort)

    def joints_of(joints: tuple[Joint, ...]) -> tuple[Joint, ...]:
        return tuple(
            replace(joint, axes=tuple(axis_of(joint, axis) for axis in joint.axes)) for joint in joints
        )

    return replace(config, joints=joints_of(config.joints), closures=joints_of(config.closures))


def _torques(config: ManipulatorConfig, task: Task, seconds: float) -> Array:
    """Return the size of the torques when there is enough of them [N m] or [N], (k, n_theta)."""
    return _run(config, task, seconds, config)[1]


def _run(
    config: ManipulatorConfig, task: Task, seconds: float, guarded: ManipulatorConfig
) -> tuple[Recording, Array]:
    """Run an arm under the guard of another, which leaves it what it needs to stop against its weight."""
    tree = ReducedTree(config)
    course = plan_course(StaticArm(tree), task, 1 / config.rate_hz)
    config = replace(config, home=course.home)
    settings: LoopSettings = loop_settings(task, "mpc", RigSettings())
    recording = Recording(config.name, settings.mpc, 1 / config.rate_hz, course.reference)
    limits = guard_limits(replace(guarded, home=course.home), tree, GuardSettings())
    hardware = Hardware(config, settings.rig, limits=limits)
    law = {"mpc": lambda model, given: RecordingLaw(recording, model, given)}
    with mock.patch.dict(LAWS, law):
        ticks, _ = run_loop(
            hardware, ReducedTree(config), course.reference, min(course.end, seconds), settings, _observe
        )
    return recording, abs(np.array([tick["tau"] for tick in ticks]))


def _observe(hardware: Hardware, estimate: Estimate) -> dict[str, Array]:
    return {"tau": np.array(hardware.tau)}
