"""Rows in closed loop: the whole chain with sensors gone, and on an arm that is not as described."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.closed_loop import Observer, run_loop
from flexarm_bringup.fault_drill.findings import Finding
from flexarm_bringup.fault_drill.payload import attaching
from flexarm_bringup.fault_drill.row import Row
from flexarm_bringup.fault_drill.stand import Stand
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.sim.sensor_faults import SensorFault
from flexarm_bringup.sim_run.report import is_stable
from flexarm_bringup.sim_run.study import SimJob, SimResult, Trace, judge_leg, loop_settings
from flexarm_bringup.static_arm import StaticArm
from flexarm_bringup.tasks.course import Course, plan_course
from flexarm_bringup.tasks.task import Task
from flexarm_bringup.tasks.task_for import task_for
from flexarm_estimator.estimate import Estimate
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.manipulator.start_pose import starting_at
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
HEAVIER, SOFTER = 1.5, float(np.sqrt(0.7))  # of all masses; of all frequencies: stiffness -30 %
LAST = 0.2  # of the window, in which an oscillation that stays is a limit cycle
RAMPED = 1.0 + 1e-9  # rounding of the rate of the torque


@dataclass(frozen=True)
class LoopRun:
    """One run in closed loop.

    Attributes:
        result: The moves, as ``flexarm sim`` judges them.
        error: Distance of the estimated tip from the true one [m], (k,).
        start: Of the first move [s].
    """

    result: SimResult
    error: Array
    start: float

    def rms(self) -> float:
        """Return the RMS tip error from the first move on [m]."""
        return float(np.sqrt(np.mean(self.error[self.result.trace.t >= self.start] ** 2)))


class NamedStand(Protocol):
    """What the loop needs to know of a stand."""

    name: str
    seed: int


class LoopStand:
    """The moves of a machine in closed loop."""

    def __init__(self, stand: NamedStand) -> None:
        """Plan the moves that the machine's task has."""
        task = task_for(stand.name)
        self.task: Task = task.under(task.presets[0])
        config = load_config(find_manipulator(task.manipulator), task.presets[0])
        self.course: Course = plan_course(StaticArm(ReducedTree(config)), self.task, 1 / config.rate_hz)
        self.config: ManipulatorConfig = starting_at(config, self.course.home)
        self.tree, self._seed = ReducedTree(self.config), stand.seed

    @property
    def middle(self) -> float:
        """Middle of the first move [s]."""
        return (self.course.legs[0].start + self.course.legs[0].end) / 2

    def run(
        self,
        law: str,
        arm: RigSettings,
        faults: Mapping[str, SensorFault] | None = None,
        then: RigSettings | None = None,
    ) -> LoopRun:
        """Do the moves under a law.

        Args:
            law: Of the controller.
            arm: How the real arm differs.
            faults: Of its sensors.
            then: How it differs from the middle of the first move on; None for no change.
        """
        settings = loop_settings(self.task, law, replace(arm, seed=self._seed))
        hardware = Hardware(self.config, settings.rig, faults=faults)
        course = self.course
        look: Observer = observe
        if then is not None:
            look = attaching(Hardware(self.config, then).rig.plant, self.middle, observe)
        ticks, effort = run_loop(hardware, self.tree, course.reference, course.end, settings, look)
        t, tip, tau, error = (np.array([tick[name] for tick in ticks]) for name in NAMES)
        limits = np.array([axis.effort for axis in self.config.actuated.values()])
        trace, preset = Trace(t, tip, tau / limits), self.task.presets[0]
        job = SimJob(self.task, preset, "", course)
        legs = tuple(judge_leg(leg, trace, job) for leg in course.legs)
        return LoopRun(SimResult(preset, "", law, legs, effort, trace), error, course.legs[0].start)


NAMES = ("t", "tip", "tau", "error")


def observe(hardware: Hardware, estimate: Estimate) -> Mapping[str, Array]:
    """Return one row of the record."""
    tip = hardware.rig.plant.tip_pose()[:3, 3]
    return {
        "t": np.array(hardware.t),
        "tip": tip,
        "tau": np.array(hardware.tau),
        "error": np.array(np.linalg.norm(estimate.T_world_tip[:3, 3] - tip)),
    }


def other_arm(stand: Stand, arm: RigSettings, factor: float) -> list[Finding]:
    """Run MPC on an arm that is not as described, against the nominal arm and against joint PD."""
    loop = LoopStand(stand)
    nominal, run, pd = loop.run("mpc", RigSettings()), loop.run("mpc", arm), loop.run("pd", arm)
    left = run.result.acceleration
    return [
        Finding("tip RMS / e0", run.rms() / nominal.rms(), factor),
        Finding("unstable or stopped", float(not is_stable(run.result, pd.result)), 0),
        Finding("residual / nominal", left / nominal.result.acceleration, 2.0),
        Finding("residual / uncontrolled", left / pd.result.acceleration, 1.0),
    ]


def very_different_arm(stand: Stand) -> list[Finding]:
    """Run MPC on an arm that is heavier and softer, and on one that takes up a payload in its first move."""
    loop, heavier = LoopStand(stand), RigSettings(body_mass_scale=HEAVIER)
    nominal = loop.run("mpc", RigSettings())
    both = loop.run("mpc", replace(heavier, frequency_scale=SOFTER))
    payload = loop.run("mpc", RigSettings(), then=heavier)
    return [
        finding
        for name, run in (("both", both), ("payload", payload))
        for finding in (
            Finding(f"{name}: tip RMS / e0", run.rms() / nominal.rms(), 2.5),
            Finding(f"{name}: limit cycle / move", 100.0 * _limit_cycle(run, loop), 2.0, "%"),
        )
    ]


def all_silent(stand: Stand) -> list[Finding]:
    """Let all sensors fall silent in the middle of the first move under MPC."""
    loop = LoopStand(stand)
    start, config = loop.middle, loop.config
    faults = {spec.name: SensorFault("off", start=start) for spec in config.sensors}
    run = loop.run("mpc", RigSettings(), faults)
    trace = run.result.trace
    left = trace.t[(trace.t >= start) & ~np.array(run.result.effort.is_led)]
    rates = np.array([axis.effort_rate / axis.effort for axis in config.actuated.values()])
    steepest = float(np.max(np.abs(np.diff(trace.load, axis=0)) / (rates * np.diff(trace.t)[:, None])))
    return [
        Finding("law left after", float(left[0] - start) if left.size else np.inf, 0.1, "s"),
        Finding("torque / limit", float(np.abs(trace.load).max()), 1.0),
        Finding("torque rate / limit", steepest, RAMPED),
    ]


def _limit_cycle(run: LoopRun, loop: LoopStand) -> float:
    """Return the largest lasting oscillation of the tip over the length of its move."""
    trace, watch = run.result.trace, loop.task.watch
    worst = 0.0
    for leg in loop.course.legs:
        end = leg.end + watch.end
        late = (trace.t <= end) & (trace.t >= end - LAST * (watch.end - watch.begin))
        moved = (trace.t >= leg.start) & (trace.t <= end)
        swing = np.linalg.norm(np.ptp(trace.tip[late], axis=0)) / 2
        worst = max(worst, float(swing / np.linalg.norm(np.ptp(trace.tip[moved], axis=0))))
    return worst


ROWS = (
    Row(6, "all sensors off in a move, under MPC", "the law is left; torque within its limits", all_silent),
    Row(
        31,
        "mass +50 %, closed loop",
        "estimator and arm stay good",
        lambda stand: other_arm(stand, RigSettings(body_mass_scale=HEAVIER), 1.5),
    ),
    Row(
        32,
        "stiffness -30 %, closed loop",
        "estimator and arm stay good",
        lambda stand: other_arm(stand, RigSettings(frequency_scale=SOFTER), 2.0),
    ),
    Row(
        33,
        "mass +50 % and stiffness -30 %; mass +50 % taken up in a move",
        "estimator stays good, no limit cycle",
        very_different_arm,
    ),
)
