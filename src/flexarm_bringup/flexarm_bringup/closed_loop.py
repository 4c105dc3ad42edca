"""The whole chain in one process without ROS: rig, estimator, controller, guard, tick by tick.

The nodes in lockstep do the same with the same objects; this is the fast way for sweeps.
"""

from __future__ import annotations

import gc
import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.demo_run.motions import Move, reference_of
from flexarm_bringup.loop_effort import Effort, LoopWatch
from flexarm_bringup.record import RunRecord, stack
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.sim.sample import Sample
from flexarm_controller.controller import Controller
from flexarm_controller.laws import LawInputs
from flexarm_controller.limits import limits_of
from flexarm_controller.margins.gate import Gate
from flexarm_controller.reference import Reference
from flexarm_controller.settings import ControllerConfig, MarginConfig, MpcConfig
from flexarm_controller.state import ArmState
from flexarm_controller.time_budget import Clocks
from flexarm_estimator.estimate import Estimate
from flexarm_estimator.estimator import Estimator
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.settled import settled_filter
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.served.linearize import linearize
from flexarm_model.served.model_schedule import ModelSchedule, ScheduleSettings, periods_between_looks
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
TOKEN = 1
NONE_TO_COME = (math.inf, np.zeros(0))  # time from which a model is used [ns], and its pose
NOTHING_LEARNED: Array = np.zeros(0)
BETWEEN_SEARCHES = 100_000  # new objects; so few of them are in cycles that a run of a minute needs no more
UNTIMED = Clocks(cpu=lambda: 0.0)  # nobody reads what a single step takes; asking the system takes 1 us
WARM_UP = 0.1  # s; what is called for the first time is compiled then, and does not count


@dataclass(frozen=True)
class LoopSettings:
    """Settings of everything in the loop; ``margins`` are wanted before it is closed, none if None."""

    controller: ControllerConfig = field(default_factory=ControllerConfig)
    mpc: MpcConfig = field(default_factory=lambda: MpcConfig(time_limit=0.0))  # no wall clock
    estimator: EstimatorConfig = field(default_factory=EstimatorConfig)
    rig: RigSettings = field(default_factory=RigSettings)
    schedule: ScheduleSettings = field(default_factory=ScheduleSettings)
    margins: MarginConfig | None = None


Observer = Callable[[Hardware, Estimate], Mapping[str, Array]]


def run_closed_loop(config: ManipulatorConfig, moves: Sequence[Move], settings: LoopSettings) -> RunRecord:
    """Follow a series of moves of one axis under control and return what happened.

    Args:
        config: The manipulator; its rate is the control rate.
        moves: The series.
        settings: Of everything in the loop.

    Raises:
        ValueError: The arm cannot follow the moves; says why.
    """
    hardware = Hardware(config, settings.rig)
    reference = reference_of(moves, hardware.dt)
    ticks, _ = run_loop(hardware, ReducedTree(config), reference, moves[-1].slot_end, settings, observe_tick)
    return stack(ticks)


@contextmanager
def past_at_rest() -> Iterator[None]:
    """Leave what exists already out of the search for garbage, which would take 50 ms out of the loop.

    What is made in the loop goes without a search, but for the rows of the record, which are to stay.
    """
    thresholds = gc.get_threshold()
    gc.freeze()
    gc.set_threshold(BETWEEN_SEARCHES, *thresholds[1:])
    try:
        yield
    finally:
        gc.set_threshold(*thresholds)
        gc.unfreeze()


@past_at_rest()
def run_loop(
    hardware: Hardware,
    tree: ReducedTree,
    reference: Reference,
    end: float,
    settings: LoopSettings,
    observe: Observer,
) -> tuple[list[Mapping[str, Array]], Effort]:
    """Follow a reference under control.

    Args:
        hardware: The rig at tick 0.
        tree: The arm as estimator and controller know it.
        reference: Of the axes.
        end: When to stop [s].
        settings: Of everything in the loop.
        observe: Makes a row of the record of every tick.

    Returns:
        The rows, and what it took.

    Raises:
        ValueError: The arm cannot follow the reference, or the margins are too small; says why.
    """
    config, model = tree.config, linearize(tree)
    estimator = Estimator(model, tree, config.sensors, settings.estimator)
    law = replace(settings.controller, period=hardware.dt)
    controller = Controller(model, limits_of(config), law, settings.mpc, UNTIMED, config)
    schedule = ModelSchedule(tree, config, reference, settings.schedule)
    if settings.mpc.foresight:
        controller.foresee(_models_to_come(tree, model, reference, settings, hardware.dt))
    fault = controller.follow(reference)
    fault = fault or _refusal(estimator, config, law, settings)
    if fault:
        raise ValueError(fault)
    hardware.guard.arm(0.0, TOKEN)
    started, adopting, watch = time.process_time(), 0.0, LoopWatch(law.law)
    samples, ticks = hardware.observe(), []
    n, warm = round(end / hardware.dt), round(WARM_UP / hardware.dt)
    coming = schedule.poses(model.pose, float(reference.t[-1]), _between_looks_ns(hardware.dt))
    due = next(coming, NONE_TO_COME)
    for k in range(n):
        started = time.process_time() if k == warm else started
        if k * hardware.rig.period_ns >= due[0]:
            adopting += _serve(schedule.make, due[1], estimator, controller)
            due = next(coming, NONE_TO_COME)
        estimate = estimator.step(measurements(samples, hardware), np.array(hardware.acted), hardware.t)
        command = controller.step(arm_state(estimate))
        ticks.append(observe(hardware, estimate))
        samples = hardware.advance()
        hardware.choose_torque(command.for_guard(k + 1, TOKEN))
        watch.note(command, hardware, estimate)
    speed = (n - warm) * hardware.dt / (time.process_time() - started)
    return ticks, watch.effort(speed, schedule.served, adopting)


def _refusal(
    estimator: Estimator, config: ManipulatorConfig, law: ControllerConfig, settings: LoopSettings
) -> str:
    """Return why the loop must not be closed, naming the mode; empty when it may, or nobody asks."""
    if settings.margins is None:
        return ""
    gate = Gate(config, LawInputs(limits_of(config), law, settings.mpc, config), settings.margins)
    return gate.judge(estimator.model, settled_filter(estimator, law.period))


def _models_to_come(
    tree: ReducedTree, model: ReducedModel, reference: Reference, settings: LoopSettings, dt: float
) -> list[tuple[float, ReducedModel]]:
    """Return all models of a reference with the time from which each is used [s], as the model node does."""
    schedule = ModelSchedule(tree, tree.config, reference, settings.schedule)
    plan = schedule.plan(model, float(reference.t[-1]), _between_looks_ns(dt))
    return [(stamp_ns * 1e-9, coming) for stamp_ns, coming in plan]


def _between_looks_ns(dt: float) -> int:
    return round(1e9 * dt) * periods_between_looks(dt)


def _serve(
    make: Callable[[Array], ReducedModel], pose: Array, estimator: Estimator, controller: Controller
) -> float:
    """Let estimator and controller go on with the model of a pose; return the CPU time it took [s]."""
    started = time.process_time()
    model = make(pose)
    estimator.adopt(model)
    controller.adopt(model)
    return time.process_time() - started


def observe_tick(hardware: Hardware, estimate: Estimate) -> dict[str, Array]:
    """Return one row of a record: the truth, the torque from now on, the estimate."""
    truth, n, n_d = hardware.rig.truth(), estimate.n, estimate.n_d
    return {
        "t": np.array(hardware.t),
        "theta": truth.theta,
        "tip": truth.tip,
        "strain": truth.strain,
        "relative": truth.acceleration - truth.rigid_acceleration,
        "tau": np.array(hardware.tau),
        "eta": np.array(estimate.eta),
        "eta_sigma": np.sqrt(np.diag(estimate.P)[n_d:n]),
        "fresh": np.array(hardware.is_commanded),
    }


def measurements(samples: Sequence[Sample], hardware: Hardware) -> list[Measurement]:
    """Return samples of the rig as the estimator takes them."""
    time_of, now, t = hardware.rig.time_of, hardware.tick, hardware.t
    return [
        Measurement(sensor, t if tick == now and not late_ns else time_of(tick, late_ns), y)
        for sensor, _, tick, y, late_ns in samples
    ]


def arm_state(estimate: Estimate) -> ArmState:
    """Return an estimate as the controller takes it."""
    x, at, usable = estimate.x, estimate.layout, estimate.is_usable
    stiffness = estimate.stiffness if at.n_learned else NOTHING_LEARNED
    sigma = np.sqrt(estimate.P.diagonal()[: 2 * at.n])
    return ArmState(
        estimate.t, estimate.model_id, x[at.theta], x[at.eta], x[at.theta_dot], x[at.eta_dot], x[at.d],
        usable, estimate.reason, sigma, x[at.s], stiffness, estimate.age,
    )  # fmt: skip
