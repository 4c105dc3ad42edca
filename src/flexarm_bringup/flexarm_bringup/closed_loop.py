"""The whole chain in one process without ROS: rig, estimator, controller, guard, tick by tick.

The nodes in lockstep do the same with the same objects; this is the fast way for sweeps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.motions import Move, reference_of
from flexarm_bringup.record import RunRecord, stack
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.plant import Plant
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.sim.sensor_simulator import Sample
from flexarm_controller.controller import Controller
from flexarm_controller.guard import GuardCommand
from flexarm_controller.limits import limits_of
from flexarm_controller.settings import ControllerConfig, MpcConfig
from flexarm_controller.state import ArmState
from flexarm_estimator.estimate import Estimate
from flexarm_estimator.estimator import Estimator
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.description import ManipulatorConfig
from flexarm_model.linearize import linearize
from flexarm_model.reduced_tree import ReducedTree

Array = NDArray[np.float64]
TOKEN = 1


@dataclass(frozen=True)
class LoopSettings:
    """Settings of everything in the loop."""

    controller: ControllerConfig = field(default_factory=ControllerConfig)
    mpc: MpcConfig = field(default_factory=lambda: MpcConfig(time_limit=0.0))  # no wall clock
    estimator: EstimatorConfig = field(default_factory=EstimatorConfig)
    rig: RigSettings = field(default_factory=RigSettings)


def run_closed_loop(
    config: ManipulatorConfig, moves: Sequence[Move], settings: LoopSettings, plant: Plant | None = None
) -> RunRecord:
    """Follow a series of moves under control and return what happened.

    Args:
        config: The manipulator; its rate is the control rate.
        moves: The series.
        settings: Of everything in the loop.
        plant: A compiled plant to reuse.

    Raises:
        ValueError: The arm cannot follow the moves; says why.
    """
    tree = ReducedTree(config)
    model = linearize(tree)
    estimator = Estimator(model, tree, config.sensors, settings.estimator)
    controller = Controller(model, limits_of(config), settings.controller, settings.mpc)
    hardware = Hardware(config, settings.rig, plant=plant)
    fault = controller.follow(reference_of(moves, hardware.dt))
    if fault:
        raise ValueError(fault)
    hardware.guard.arm(0.0, TOKEN)
    samples, ticks = hardware.observe(), []
    for k in range(round(moves[-1].slot_end / hardware.dt)):
        estimate = estimator.step(_measurements(samples, hardware), np.array(hardware.acted), hardware.t)
        command = controller.step(_state(estimate))
        ticks.append(observe_tick(hardware, estimate))
        samples = hardware.advance()
        hardware.choose_torque(GuardCommand(command.t, k + 1, TOKEN, tuple(map(float, command.tau))))
    return stack(ticks)


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
        "fresh": np.array(hardware.guard.age <= hardware.dt * 1.5),
    }


def _measurements(samples: Sequence[Sample], hardware: Hardware) -> list[Measurement]:
    return [Measurement(sample.sensor, hardware.rig.time_of(sample.tick), sample.y) for sample in samples]


def _state(estimate: Estimate) -> ArmState:
    usable = estimate.status in ("ok", "degraded")
    return ArmState(
        estimate.t, estimate.model_id, estimate.theta, estimate.eta, estimate.theta_dot, estimate.eta_dot,
        estimate.d, usable, estimate.reason,
    )  # fmt: skip
