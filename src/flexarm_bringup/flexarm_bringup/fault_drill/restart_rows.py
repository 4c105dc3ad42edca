"""Row about restarts: estimator or controller begin anew in the middle of a move."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.closed_loop import arm_state, measurements
from flexarm_bringup.fault_drill.controller_stand import ControllerStand
from flexarm_bringup.fault_drill.findings import ROUNDED, Finding
from flexarm_bringup.fault_drill.row import Row
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.sim_run.study import loop_settings
from flexarm_controller.trust import deviation_scale
from flexarm_estimator.estimator import Estimator

Array = NDArray[np.float64]
AFTER = 2.0  # s that are watched after the restart
WINDOW = 0.1  # s over which the tip error is taken as RMS
BACK = 2.0  # e0


@dataclass(frozen=True)
class Run:
    """A run.

    Attributes:
        error: Of the tip [m], (k,).
        tau: Torque [N m] or [N], (k, n_theta).
        modes: Rungs of the controller, (k,).
        sigma: Largest 3 sigma of the estimated state, in deviations that cost 1, (k,).
        guard: Why the guard stopped the arm; empty when it did not.
    """

    error: Array
    tau: Array
    modes: tuple[str, ...]
    sigma: Array
    guard: str


def restarts(stand: ControllerStand) -> list[Finding]:
    """Restart the estimator, or the controller, in the middle of the first move."""
    k0 = round(stand.loop.middle / stand.dt)
    nominal = _run(stand, "", k0)
    window = round(WINDOW / stand.dt)
    e0 = float(np.sqrt(np.mean(nominal.error[k0:] ** 2)))
    findings: list[Finding] = []
    for what in ("estimator", "controller"):
        run = _run(stand, what, k0)
        windows = np.lib.stride_tricks.sliding_window_view(run.error[k0:], window)
        bad = np.flatnonzero(np.sqrt(np.mean(windows**2, axis=1)) > BACK * e0)
        back = (int(bad[-1]) + 1) * stand.dt if bad.size else 0.0
        steps = abs(np.diff(run.tau, axis=0)) / (stand.limits.effort_rate * stand.dt)
        if what == "estimator":  # a controller that begins anew is told an estimate that is sure
            findings.append(_blind(run.sigma[k0:], run.modes[k0:], stand.config.start_sigma))
        findings += [
            Finding(f"{what}: torque step / limit, guard's output", float(steps.max()), ROUNDED),
            Finding(f"{what}: tip RMS within {BACK:g} e0 again after", back, 1.0, "s"),
            Finding(f"{what}: stopped by the guard", float(bool(run.guard)), 0),
        ]
    return findings


def _blind(sigma: Array, modes: tuple[str, ...], limit: float) -> Finding:
    """Return in how many of the cycles before the estimate had become sure the law acted."""
    sure = np.flatnonzero(sigma <= limit)
    unsure = int(sure[0]) if sure.size else len(sigma)
    what = f"estimator: of {unsure} cycles until 3 sigma were small, under the law"
    return Finding(what, modes[:unsure].count("mpc"), 0)


def _run(stand: ControllerStand, restarted: str, k0: int) -> Run:
    """Do the first move under MPC on the nonlinear rig; restart something at tick ``k0``."""
    loop = stand.loop
    settings = loop_settings(loop.task, "mpc", RigSettings(seed=stand.seed))
    hardware = Hardware(loop.config, settings.rig, plant=stand.hardware.rig.plant)
    sensors, model = loop.config.sensors, stand.model
    estimator, controller = Estimator(model, loop.tree, sensors, settings.estimator), stand.controller()
    hardware.guard.arm(0.0, 1)
    rows, samples, scale = [], hardware.observe(), deviation_scale(model, stand.mpc, stand.dt)
    for k in range(k0 + round(AFTER / stand.dt)):
        if k == k0 and restarted == "estimator":
            estimator = Estimator(model, loop.tree, sensors, settings.estimator)
        if k == k0 and restarted == "controller":
            controller = stand.controller()
        estimate = estimator.step(measurements(samples, hardware), np.array(hardware.acted), hardware.t)
        command = controller.step(arm_state(estimate))
        error = np.linalg.norm(estimate.T_world_tip[:3, 3] - hardware.rig.plant.tip_pose()[:3, 3])
        sigma = 3.0 * (np.sqrt(estimate.P.diagonal()[: scale.size]) * scale).max()
        rows.append((error, np.array(hardware.tau), command.mode, sigma))
        samples = hardware.advance()
        hardware.choose_torque(command.for_guard(k + 1, 1))
    errors, torques, modes, sigmas = zip(*rows, strict=True)
    return Run(np.array(errors), np.array(torques), modes, np.array(sigmas), hardware.guard.reason)


ROWS = (
    Row(45, "estimator or controller restarts in a move", "takes over when sure, without a jump", restarts),
)
