"""The comparison behind ``flexarm sim``: joint PD and MPC on one reference, on the arm as described and not.

A job is one condition of one preset: both laws on the same plant, in lockstep in one process. Jobs are
independent and run on all cores.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.closed_loop import LoopSettings, run_loop
from flexarm_bringup.loop_effort import Effort
from flexarm_bringup.margins.loop import Loop
from flexarm_bringup.parallel import run_parallel
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.plant import Plant
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.sim_run.conditions import CONDITIONS, NOMINAL, describe_idle, idle_conditions
from flexarm_bringup.static_arm import StaticArm
from flexarm_bringup.tasks.course import Course, Leg, plan_course
from flexarm_bringup.tasks.driven_arm import load_driven
from flexarm_bringup.tasks.task import Task
from flexarm_bringup.tip_vibration import Residual, read_residual
from flexarm_controller.settings import ControllerConfig, MpcConfig
from flexarm_estimator.estimate import Estimate
from flexarm_estimator.late_sensors import late_sensors
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.bodies.few_modes import describe_few_modes
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.manipulator.start_pose import starting_at
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.control_rate import describe_rate, refuse_slow_rate
from flexarm_model.served.linearize import linearize
from flexarm_model.served.model_schedule import ScheduleSettings
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
LAWS = ("pd", "mpc")
SEED = RigSettings().seed
SAME_POSE = 6  # digits after the point [rad or m]
MOST_LOST = 0.1  # share of the periods without a state or plan; the first ones wait for the camera


@dataclass(frozen=True)
class SimJob:
    """What one worker does: a preset, a condition, the laws to compare, the seed of the rig's noise."""

    task: Task
    preset: str
    condition: str
    course: Course
    laws: tuple[str, ...] = LAWS
    seed: int = SEED


@dataclass(frozen=True)
class Trace:
    """What the tip did: times [s] (k,), position [m] (k, 3), torque over its limit (k, n_theta)."""

    t: Array
    tip: Array
    load: Array


@dataclass(frozen=True)
class LegResult:
    """One move under one law.

    Attributes:
        leg: The move.
        residual: What is left after it.
        tracking: Largest distance of the tip from where the reference wants it, from start to end [m].
        peak: Largest torque over its limit, until the next move [1].
    """

    leg: Leg
    residual: Residual
    tracking: float
    peak: float


@dataclass(frozen=True)
class SimResult:
    """One law under one condition.

    Attributes:
        preset, condition, law: Which.
        legs: Every move.
        effort: What it took.
        trace: What the tip did.
        told: Of the control rate, of what in the description does not fit the settings, of what the rig
            cannot change of the arm, and of bodies that keep too few modes.
        refusals: Why the controller node would not let the arm move from where it rests, at the start and
            after the moves; of the arm as described alone, empty where it would.
    """

    preset: str
    condition: str
    law: str
    legs: tuple[LegResult, ...]
    effort: Effort
    trace: Trace
    told: tuple[str, ...] = ()
    refusals: tuple[str, ...] = ()

    @property
    def acceleration(self) -> float:
        """Residual of all moves together, RMS [m/s^2]."""
        return float(np.sqrt(np.mean([leg.residual.acceleration**2 for leg in self.legs])))

    @property
    def failure(self) -> str:
        """Why its figures say nothing of the law: the guard's reason, or a state lost; empty when they do."""
        guard = self.effort.guard
        return f"the guard stopped it: {guard}" if guard else lost_state(self.effort)


def lost_state(effort: Effort) -> str:
    """Return when and why the motion was given up, or how often the law did not lead; empty when seldom."""
    if effort.given_up or effort.unusable <= MOST_LOST:
        return effort.given_up
    return f"no usable state or no plan in {100 * effort.unusable:.0f} % of the periods"


def sim_jobs(task: Task, presets: Sequence[str], conditions: Sequence[str], seed: int = SEED) -> list[SimJob]:
    """Return everything there is to run: the first preset in all conditions, the others as described.

    Conditions that change nothing of the arm are left out.

    Args:
        task: What the arm does.
        presets: Of its description.
        conditions: Names of ``CONDITIONS``.
        seed: Of the rig's noise.

    Raises:
        ConfigError: A preset or a description is wrong.
        ValueError: The arm cannot do a move.
    """
    jobs = []
    for i, preset in enumerate(presets):
        config = load_driven(task.manipulator, preset)
        course = plan_course(StaticArm(ReducedTree(config)), task, 1 / config.rate_hz)
        idle = idle_conditions(config) if i == 0 else [name for name in conditions if name != NOMINAL]
        wanted = [name for name in conditions if name not in idle]
        jobs += [SimJob(task, preset, condition, course, seed=seed) for condition in wanted]
    return jobs


def run_sim_job(job: SimJob) -> list[SimResult]:
    """Run every law of a job.

    Raises:
        ConfigError: The control rate cannot follow the slowest mode.
    """
    config = load_config(find_manipulator(job.task.manipulator), job.preset)
    config = starting_at(config, job.course.home)
    tree, plant = ReducedTree(config), None
    omega = linearize(tree).omega
    refuse_slow_rate(config, omega)
    rig = replace(CONDITIONS[job.condition], seed=job.seed)
    results = []
    for law in job.laws:
        settings = loop_settings(job.task.under(job.preset), law, rig)
        hardware = Hardware(config, settings.rig, plant=plant)
        plant = hardware.rig.plant
        ticks, effort = run_loop(hardware, tree, job.course.reference, job.course.end, settings, observe_tip)
        trace = _trace(ticks, config)
        legs = tuple(judge_leg(leg, trace, job) for leg in job.course.legs)
        told = *describe_rate(config.rate_hz, omega), *late_sensors(config.sensors, settings.estimator)
        told = *told, *describe_idle(config), *describe_few_modes(config)
        refusals = _refusals(job, config, settings) if job.condition == NOMINAL else ()
        results.append(SimResult(job.preset, job.condition, law, legs, effort, trace, told, refusals))
    return results


def run_sim_jobs(todo: Sequence[SimJob], done: Callable[[int, int], None]) -> list[SimResult]:
    """Run jobs in parallel processes; ``done`` is told after each how many of how many are done."""
    return run_parallel(run_sim_job, todo, done)


def loop_settings(task: Task, law: str, rig: RigSettings) -> LoopSettings:
    """Return the settings of a run: the task's, without any wall clock."""
    return LoopSettings(
        controller=replace(task.make("controller", ControllerConfig), law=law),
        mpc=replace(task.make("mpc", MpcConfig), time_limit=0.0),
        estimator=task.make("estimator", EstimatorConfig),
        rig=rig,
        schedule=task.make("schedule", ScheduleSettings),
    )


def observe_tip(hardware: Hardware, estimate: Estimate) -> Mapping[str, Array]:
    """Return one row of the record: time, true tip, torque from now on."""
    plant: Plant = hardware.rig.plant
    return {"t": np.array(hardware.t), "tip": plant.tip_pose()[:3, 3], "tau": np.array(hardware.tau)}


def judge_leg(leg: Leg, trace: Trace, job: SimJob) -> LegResult:
    """Return what a move was worth, from what the tip did."""
    moving = (trace.t >= leg.start) & (trace.t <= leg.end)
    error = np.linalg.norm(trace.tip - job.course.tip_at(trace.t), axis=1)
    slot = (trace.t >= leg.start) & (trace.t <= leg.end + job.task.wait)
    residual = read_residual(trace.t, trace.tip, leg.start, leg.end, job.task.watch)
    return LegResult(leg, residual, float(error[moving].max()), float(abs(trace.load[slot]).max()))


def _refusals(job: SimJob, config: ManipulatorConfig, settings: LoopSettings) -> tuple[str, ...]:
    loop = Loop(config, settings.estimator, (settings.controller, settings.mpc))
    ends = [job.course.reference.position(leg.end) for leg in job.course.legs]
    poses = {tuple(np.round(pose, SAME_POSE).tolist()): pose for pose in (job.course.home, *ends)}
    return tuple(filter(None, map(loop.judge, poses.values())))


def _trace(ticks: Sequence[Mapping[str, Array]], config: ManipulatorConfig) -> Trace:
    t, tip, tau = (np.array([tick[name] for tick in ticks]) for name in ("t", "tip", "tau"))
    return Trace(t, tip, tau / np.array([axis.effort for axis in config.actuated.values()]))
