"""Cost of one estimator step of the single link, beside plain filterpy doing the same work.

CPU time of this thread. The sensors are those of the simulated rig: encoder, strain gauge and accelerometer
in every period, a camera at 30 Hz whose frames are 60 ms old. A late frame makes the estimator compute twelve
instants again: "late_frame" are the ticks with one, "ordinary" those without, all else is of all ticks. The
baseline predicts and updates with filterpy as it is, one scalar at a time, without gate, checks, health and
tip, and recomputes twelve periods for every frame.
"""

from __future__ import annotations

import gc
import math
import time
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from filterpy.kalman import KalmanFilter
from numpy.typing import NDArray

from flexarm_bringup.sim.hardware import Hardware, HardwareSettings
from flexarm_bringup.sim.rig import RigSettings
from flexarm_controller.guard import GuardCommand
from flexarm_estimator.estimator import Estimator
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.process import ProcessModel
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.config import load_config
from flexarm_model.description import ManipulatorConfig
from flexarm_model.linearize import linearize
from flexarm_model.manipulator_file import find_manipulator
from flexarm_model.reduced_tree import ReducedTree

Array = NDArray[np.float64]
WARM_UP = 100  # ticks not counted: caches fill
TORQUE = 0.5  # N m
TOKEN = 1


class Tick(NamedTuple):
    """What reaches the estimator in one period."""

    t: float
    tau: Array
    samples: list[Measurement]

    @property
    def has_frame(self) -> bool:
        """A camera frame is among the samples."""
        return any(sample.sensor == "camera" for sample in self.samples)


def record_ticks(config: ManipulatorConfig, seconds: float) -> list[Tick]:
    """Shake the simulated rig and return what its sensors say."""
    hardware = Hardware(config, RigSettings(), HardwareSettings())
    hardware.guard.arm(0.0, TOKEN)
    samples, ticks = hardware.rig.observe(), []
    for k in range(round(seconds / hardware.dt)):
        measurements = [Measurement(s.sensor, hardware.rig.time_of(s.tick), s.y) for s in samples]
        ticks.append(Tick(hardware.t, np.array(hardware.acted), measurements))
        samples = hardware.advance()
        hardware.choose_torque(GuardCommand(hardware.t, k + 1, TOKEN, (TORQUE * math.sin(7.0 * hardware.t),)))
    return ticks


def time_estimator(estimator: Estimator, ticks: Sequence[Tick]) -> Array:
    """Return the CPU time of every step [us], (k,)."""
    spent = np.empty(len(ticks))
    for k, tick in enumerate(ticks):
        start = time.thread_time_ns()
        estimator.step(tick.samples, tick.tau, tick.t)
        spent[k] = (time.thread_time_ns() - start) * 1e-3
    return spent


def time_filterpy(process: ProcessModel, ticks: Sequence[Tick], dt: float) -> Array:
    """Return the CPU time of plain filterpy [us], (k,); the third sensor's correlation is ignored."""
    step, system = process.step(dt), process.system
    kalman = KalmanFilter(dim_x=system.n_x, dim_z=1, dim_u=2)
    kalman.F, kalman.B, kalman.Q, kalman.P = step.A, step.B, step.Q, process.P0
    rows = [system.C[i : i + 1] for i in range(3)]
    R = [np.array([[value]]) for value in (4e-10, 1e-12, 1e-2)]
    z, u = np.zeros(1), np.zeros(2)
    spent = np.empty(len(ticks))

    def advance() -> None:
        kalman.predict(u)
        for H, noise in zip(rows, R, strict=True):
            kalman.update(z, R=noise, H=H)

    kalman.x = np.zeros(system.n_x)
    for k, tick in enumerate(ticks):
        start = time.thread_time_ns()
        if tick.has_frame:
            for _ in range(12):
                advance()
        advance()
        spent[k] = (time.thread_time_ns() - start) * 1e-3
    return spent


def main(seconds: float = 20.0) -> dict[str, float]:
    """Measure; returns times in microseconds and ratios to the baseline."""
    config = load_config(find_manipulator("single_link"), "geared")
    tree = ReducedTree(config)
    model = linearize(tree)
    ticks = record_ticks(config, seconds)
    estimator = Estimator(model, tree, config.sensors, EstimatorConfig())
    process = ProcessModel(model, EstimatorConfig())
    gc.collect()
    gc.freeze()  # as the nodes do
    ours = time_estimator(estimator, ticks)[WARM_UP:]
    plain = time_filterpy(process, ticks, 1.0 / config.rate_hz)[WARM_UP:]
    gc.unfreeze()
    late = np.array([tick.has_frame for tick in ticks])[WARM_UP:]
    return {
        "estimator_median_us": float(np.median(ours)),
        "estimator_p99_us": float(np.percentile(ours, 99)),
        "ordinary_p99_us": float(np.percentile(ours[~late], 99)),
        "late_frame_median_us": float(np.median(ours[late])),
        "late_frame_p99_us": float(np.percentile(ours[late], 99)),
        "filterpy_median_us": float(np.median(plain)),
        "filterpy_p99_us": float(np.percentile(plain, 99)),
        "filterpy_late_frame_median_us": float(np.median(plain[late])),
        "ratio_median": float(np.median(ours) / np.median(plain)),
        "ratio_p99": float(np.percentile(ours, 99) / np.percentile(plain, 99)),
        "ratio_late_frame": float(np.median(ours[late]) / np.median(plain[late])),
    }


if __name__ == "__main__":
    for name, value in main().items():
        print(f"{name:32} {value:12.1f}")
