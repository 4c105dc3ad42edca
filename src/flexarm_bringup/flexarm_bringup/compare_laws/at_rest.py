"""What every law leaves at rest, by the noise of the sensors alone: no motion, no simulation.

The arm is the served one at the end of the last move, with its frequencies as described and off; the signal
is the one that the residual is read from, through the same low-pass. Refused samples and cameras are not in
it. On average over many runs no law leaves less after a move.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from flexarm_bringup.compare_laws.schemes import LQR, MPC, PD
from flexarm_bringup.tasks.task import Task
from flexarm_bringup.tip_vibration import NYQUIST_SHARE, ORDER
from flexarm_controller.laws import LAWS, LawInputs
from flexarm_controller.limits import limits_of
from flexarm_controller.margins.full_plant import build_plant
from flexarm_controller.margins.law_gain import find_law_gain
from flexarm_controller.margins.loop import close_loop
from flexarm_controller.margins.noise_floor import Look, noise_floor
from flexarm_controller.program.delay import in_whole_periods, torques_kept
from flexarm_controller.settings import ControllerConfig, MpcConfig
from flexarm_estimator.estimator import Estimator
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.settled import settled_filter
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]


@dataclass(frozen=True)
class AtRest:
    """What a law leaves at rest.

    Attributes:
        law: The law.
        floors: RMS of the signal by frequency error [m/s^2].
    """

    law: str
    floors: dict[float, float]


def floors_at_rest(
    task: Task, preset: str, pose: Array, errors: tuple[float, ...], laws: tuple[str, ...] = (PD, LQR, MPC)
) -> list[AtRest]:
    """Return what noise leaves under every law at a pose; without those whose loop is not stable there.

    Raises:
        ValueError: A law has no answer at rest.
    """
    task = task.under(preset)
    config = load_config(find_manipulator(task.manipulator), preset)
    tree, dt = ReducedTree(config, use_compiler=False), 1.0 / config.rate_hz
    model = linearize(tree, pose)
    estimator = Estimator(
        model, tree, config.sensors, task.make("estimator", EstimatorConfig), use_compiler=False
    )
    filter_ = settled_filter(estimator, dt)
    signal, rows, look = _signal(model, task, config, dt)
    mpc = replace(task.make("mpc", MpcConfig), time_limit=0.0, foresight=False)
    mpc, delay, found = in_whole_periods(mpc, dt), torques_kept(mpc, dt), []
    for name in laws:
        control = replace(task.make("controller", ControllerConfig), law=name, period=dt)
        inputs = LawInputs(limits_of(config), control, mpc, config)
        law = find_law_gain(LAWS[name](model, inputs), model, inputs.limits.effort, delay)
        floors = {}
        for error in errors:
            loop = close_loop(build_plant(model, filter_.rows, dt, error), filter_, law, delay)
            seen = build_plant(signal, rows, dt, error)
            try:
                each = noise_floor(loop, filter_, _sigma(config, filter_.rows), seen, look)
            except ValueError:  # not stable
                continue
            floors[error] = float(np.linalg.norm(each))
        found.append(AtRest(name, floors))
    return found


def _sigma(config: ManipulatorConfig, rows: tuple[str, ...]) -> Array:
    """Return the described noise of output rows "sensor.channel", (n,)."""
    by_row = {
        f"{spec.name}.{channel}": sigma
        for spec in config.sensors
        for channel, sigma in zip(spec.channels, spec.sigma, strict=True)
    }
    return np.array([by_row[row] for row in rows])


def _signal(
    model: ReducedModel, task: Task, config: ManipulatorConfig, dt: float
) -> tuple[ReducedModel, tuple[str, ...], Look]:
    """Return a model whose rows are the signal, their names, and how it becomes the judged one."""
    out, watch = model.outputs, task.watch
    cutoff = min(watch.cutoff_hz, NYQUIST_SHARE / (2.0 * dt))
    zeros, poles, gain = scipy.signal.butter(ORDER, cutoff, fs=1.0 / dt, output="zpk")
    zeros, poles, gain = np.tile(zeros, 2), np.tile(poles, 2), gain**2  # forward and backward
    if task.compare.signal == "tip":  # positions; their second difference is the acceleration
        rows = tuple(out.names[i] for i in out.rows("tip") if out.units[i] == "m")
        zeros, poles, gain = np.append(zeros, [1.0, 1.0]), np.append(poles, [0.0, 0.0]), gain / dt**2
        return model, rows, Look(*scipy.signal.zpk2ss(zeros, poles, gain))
    kinds = {spec.name for spec in config.sensors if spec.kind == "accelerometer"}
    rows = tuple(name for name in out.names if name.split(".")[0] in kinds)
    C_acc = out.C_acc.copy()
    C_acc[:, : model.n_theta] = 0.0  # what a rigid arm feels
    none = np.zeros_like(C_acc)
    elastic = replace(model, outputs=replace(out, C_pos=none, C_vel=none, C_acc=C_acc))
    return elastic, rows, Look(*scipy.signal.zpk2ss(zeros, poles, gain))
