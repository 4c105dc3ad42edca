"""Running schemes on the simulated arm: rows of one condition share the arm, conditions run in parallel."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.closed_loop import run_loop
from flexarm_bringup.compare_laws.judged import (
    CompareResult,
    TrueRecord,
    judge_leg,
    stack_rows,
    true_row,
)
from flexarm_bringup.compare_laws.schemes import SERVO, Scheme
from flexarm_bringup.parallel import run_parallel
from flexarm_bringup.servo_run import lead
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.rig import Rig, RigSettings
from flexarm_bringup.sim_run.study import SEED, loop_settings, lost_state
from flexarm_bringup.tasks.task import Task
from flexarm_estimator.estimate import Estimate
from flexarm_model.manipulator.description import Joint, ManipulatorConfig
from flexarm_model.manipulator.start_pose import starting_at
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import find_equilibrium
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
BEFORE_END = 0.3  # s of the first move that a trace shows


@dataclass(frozen=True)
class CompareJob:
    """What one worker does: rows on one arm.

    Attributes:
        task: What the arm does and how it is judged.
        preset: Preset of the description.
        home: Where it starts [rad or m], (n_theta,).
        frequency_error: Real over described frequencies, minus 1.
        schemes: The rows.
        seed: Of the rig's noise.
    """

    task: Task
    preset: str
    home: Array
    frequency_error: float
    schemes: tuple[Scheme, ...]
    seed: int = SEED


def run_compare_jobs(
    todo: Sequence[CompareJob], done: Callable[[int, int], None], workers: int | None = None
) -> list[CompareResult]:
    """Run jobs in parallel processes; ``done`` is told after each how many of how many are done."""
    return run_parallel(run_compare_job, todo, done, workers)


def run_compare_job(job: CompareJob) -> list[CompareResult]:
    """Run every row of a job on the same arm."""
    arm = _Arm(job)
    return [arm.run(scheme) for scheme in job.schemes]


class _Arm:
    """The real arm of a job, and the described one."""

    def __init__(self, job: CompareJob) -> None:
        self._job = job
        self._config = starting_at(load_config(find_manipulator(job.task.manipulator), job.preset), job.home)
        self._rig = RigSettings(seed=job.seed, frequency_scale=1.0 + job.frequency_error)
        self._plant = Rig(self._config, self._rig).plant
        self._limits = np.array([axis.effort for axis in self._config.actuated.values()])
        self._trees: dict[bytes, ReducedTree] = {}
        self._resting: dict[bytes, Array] = {}

    def run(self, scheme: Scheme) -> CompareResult:
        """Run a row and judge it."""
        try:
            record, stopped = self._lead(scheme) if scheme.law == SERVO else self._control(scheme)
        except ValueError as error:
            return self._result(scheme, None, str(error))
        return self._result(scheme, record, stopped)

    def _lead(self, scheme: Scheme) -> tuple[TrueRecord, str]:
        rig = Rig(self._config, self._rig, self._plant)
        times = np.arange(round(scheme.end / rig.dt) + 1.0) * rig.dt
        truths = lead(rig, scheme.reference.sample(times)[1])
        nothing = np.zeros(self._limits.size)
        rows = [true_row(t, truth, nothing) for t, truth in zip(times, truths, strict=True)]
        return stack_rows(rows, self._limits), ""

    def _control(self, scheme: Scheme) -> tuple[TrueRecord, str]:
        config = with_effort(self._config, scheme.effort)
        key = b"" if scheme.effort is None else scheme.effort.tobytes()
        if key not in self._trees:
            self._trees[key] = ReducedTree(config)
        settings = loop_settings(self._job.task.under(self._job.preset), scheme.law, self._rig)
        hardware = Hardware(config, self._rig, plant=self._plant)
        ticks, effort = run_loop(hardware, self._trees[key], scheme.reference, scheme.end, settings, _observe)
        return stack_rows(ticks, self._limits), effort.guard or lost_state(effort)

    def _result(self, scheme: Scheme, record: TrueRecord | None, stopped: str) -> CompareResult:
        job, legs, t, off = self._job, [], np.zeros(0), np.zeros(0)
        if record is not None:
            ends = [(self._rest(scheme, leg.start), self._rest(scheme, leg.end)) for leg in scheme.legs]
            legs = [
                judge_leg(record, leg, job.task, *places)
                for leg, places in zip(scheme.legs, ends, strict=True)
            ]
            first = scheme.legs[0]
            shown = (record.t >= first.end - BEFORE_END) & (record.t <= first.end + job.task.watch.end)
            t, off = record.t[shown] - first.end, np.linalg.norm(record.tip[shown] - ends[0][1], axis=1)
        return CompareResult(
            job.preset, job.frequency_error, scheme.motion, scheme.law, scheme.effort is not None,
            tuple(legs), stopped, t, off,
        )  # fmt: skip

    def _rest(self, scheme: Scheme, t: float) -> Array:
        """Return where the tip of the real arm rests with its axes where the reference is at ``t``, (3,)."""
        theta = scheme.reference.position(t)
        key = np.round(theta, 9).tobytes()
        if key not in self._resting:
            q, _ = find_equilibrium(self._plant.tree, theta)
            self._resting[key] = np.array(self._plant.tree.functions["tip_pose"](q))[:3, 3]
        return self._resting[key]


def with_effort(config: ManipulatorConfig, effort: Array | None) -> ManipulatorConfig:
    """Return the description with other torque limits (n_theta,), or as it is."""
    if effort is None:
        return config
    limit = dict(zip(config.actuated, effort.tolist(), strict=True))

    def change(joint: Joint) -> Joint:
        """Return the joint with the limits of its axes."""
        axes = (replace(a, effort=limit.get(f"{joint.name}.{a.name}", a.effort)) for a in joint.axes)
        return replace(joint, axes=tuple(axes))

    joints, closures = (tuple(map(change, group)) for group in (config.joints, config.closures))
    return replace(config, joints=joints, closures=closures)


def _observe(hardware: Hardware, estimate: Estimate) -> Mapping[str, Array]:
    return true_row(hardware.t, hardware.rig.truth(), np.array(hardware.tau))
