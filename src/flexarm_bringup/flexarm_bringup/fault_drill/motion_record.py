"""What the simulated rig did on a tour of moves under joint PD: the run that every fault is injected into.

The rig is nonlinear and has more modes than the model; the drives hold the axes by their own encoders, so
the motion owes nothing to the estimator. Sensors are sound here: faults act on a copy of their samples.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.sim.motor_side import MotorSide
from flexarm_bringup.sim.plant import Plant
from flexarm_bringup.sim.rig import Rig, RigSettings
from flexarm_bringup.sim.sensor_faults import Arrival
from flexarm_bringup.static_arm import StaticArm
from flexarm_bringup.tasks.course import Course, plan_course
from flexarm_bringup.tasks.task import Task
from flexarm_bringup.tasks.task_for import task_for, tour
from flexarm_controller.controller import Controller
from flexarm_controller.limits import limits_of
from flexarm_controller.settings import ControllerConfig
from flexarm_controller.state import ArmState
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.motion.profiles import Trapezoid
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.served.model_schedule import ModelSchedule, ScheduleSettings, periods_between_looks
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
DURATION = 6.5  # s; long enough for a fault of 2 s and for what comes after it
MOVE = Trapezoid(1.0, 1.5, 0.1, 0.1)  # every move; its ramps are short enough to shake the arm
REST = 0.2  # s between two moves, in which it rings


@dataclass(frozen=True)
class DrilledArm:
    """An arm, what it does, and its rig.

    Attributes:
        config: The manipulator, starting where the task does.
        task: Its settings of estimator, controller and schedule.
        tree: The arm as estimator and controller know it.
        course: The tour.
        plant: The arm as it really is, compiled.
    """

    config: ManipulatorConfig
    task: Task
    tree: ReducedTree
    course: Course
    plant: Plant


@dataclass(frozen=True)
class MotionRecord:
    """The run, tick by tick.

    Attributes:
        dt: Period [s].
        t: Times [s], (k,).
        tau: Torque that acted until then [N m or N], (k, n_theta).
        tip: Where the tip really was [m], (k, 3).
        arrivals: What the sensors said, in order of arrival.
        model: The served model at the start.
        served: Models adopted on the way, by tick.
    """

    dt: float
    t: Array
    tau: Array
    tip: Array
    arrivals: tuple[Arrival, ...]
    model: ReducedModel
    served: Mapping[int, ReducedModel]


def drilled_arm(name: str, simulation: RigSettings) -> DrilledArm:
    """Return an arm with its tour of moves, repeated until ``DURATION``.

    Raises:
        ConfigError: There is no such manipulator, or it has no motor.
    """
    task = task_for(name)
    task = task.under(task.presets[0])
    config = load_config(find_manipulator(task.manipulator), task.presets[0])
    moves = tour(name, config, MOVE).moves
    rounds = int(np.ceil(DURATION / (len(moves) * (MOVE.duration + REST))))
    repeated = {f"{move} ({i})": what for i in range(rounds) for move, what in moves.items()}
    task = replace(task, moves=repeated, wait=REST, start="home")
    tree = ReducedTree(config)
    course = plan_course(StaticArm(tree), task, 1 / config.rate_hz)
    rig = Rig(config, simulation)
    return DrilledArm(config, task, tree, course, rig.plant)


def record_motion(
    arm: DrilledArm, simulation: RigSettings, kicks: Mapping[int, Array] | None = None
) -> MotionRecord:
    """Let the rig do the tour and record it.

    Args:
        arm: The arm.
        simulation: Seed and noise.
        kicks: Torques that nobody is told of, for the period that begins at a tick [N m or N], (n_theta,).
    """
    rig = Rig(arm.config, simulation, arm.plant)
    model = linearize(arm.tree)
    motors, controller = MotorSide(arm.config, rig.dt), _joint_pd(arm, model, rig.dt)
    tau = np.zeros(model.n_theta)
    rows, arrivals = [], []
    samples = rig.observe()
    n = round(DURATION / rig.dt)
    for k in range(n + 1):
        motors.update(samples)
        arrivals += [Arrival(k, sample) for sample in samples]
        rows.append((rig.time_of(k), tau, rig.plant.tip_pose()[:3, 3].copy()))
        tau = controller.step(drive_state(motors, model, rig.time_of(k))).tau
        samples = rig.step(tau + (kicks or {}).get(k, 0.0))
    t, acted, tip = (np.array(column) for column in zip(*rows, strict=True))
    return MotionRecord(rig.dt, t, acted, tip, tuple(arrivals), model, _served(arm, model, n, rig.dt))


def _joint_pd(arm: DrilledArm, model: ReducedModel, dt: float) -> Controller:
    law = replace(arm.task.make("controller", ControllerConfig), law="pd", period=dt)
    controller = Controller(model, limits_of(arm.config), law)
    fault = controller.follow(arm.course.reference)
    if fault:
        raise ValueError(fault)
    return controller


def drive_state(motors: MotorSide, model: ReducedModel, t: float) -> ArmState:
    """Return the state as the drives alone know it: no modes."""
    still = np.zeros(model.n_eta)
    return ArmState(
        t, model.model_id, motors.theta.copy(), still, motors.theta_dot.copy(), still, np.zeros(model.n_theta)
    )


def _served(arm: DrilledArm, model: ReducedModel, n: int, dt: float) -> dict[int, ReducedModel]:
    settings = arm.task.make("schedule", ScheduleSettings)
    schedule = ModelSchedule(arm.tree, arm.config, arm.course.reference, settings)
    look_ns = round(periods_between_looks(dt) * dt * 1e9)
    plan = schedule.plan(model, n * dt, look_ns)
    return {round(t_ns * 1e-9 / dt): served for t_ns, served in plan}
