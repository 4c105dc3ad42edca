"""Cost of the model: reducing a beam, serving a pose, simulating the arm.

CPU time of this thread, medians and 99th percentiles. Simulated seconds per second compare the plant of the
simulated rig (compiled reduced tree, twice the modes of the controller) with the segment tree at a segment
count whose first frequency is within 0.1 %.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from flexarm_bringup.sim.plant import Plant
from flexarm_model.bodies.body_reduction import reduce_body
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.segments.segment_tree import SegmentTree
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

SEGMENTS = 16  # first frequency 0.07 % high
SEGMENT_STEP = 0.2e-3  # s; explicit Runge-Kutta of 16 segments is stable up to about 0.12 ms times 2


def cpu_times(action: Callable[[], object], repeats: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return the CPU time of every repetition [s], (repeats,)."""
    spent = np.empty(repeats)
    for i in range(repeats):
        start = time.thread_time_ns()
        action()
        spent[i] = (time.thread_time_ns() - start) * 1e-9
    return spent


def simulate_segments(tree: SegmentTree, seconds: float, dt: float) -> None:
    """Let the segment tree ring freely by classical Runge-Kutta steps."""
    q, v, none = np.zeros(tree.n_q), np.zeros(tree.n_q), np.zeros(tree.n_q)
    v[tree.actuated] = 1.0
    for _ in range(round(seconds / dt)):
        a1 = tree.forward_dynamics(q, v, none)
        a2 = tree.forward_dynamics(q + dt / 2 * v, v + dt / 2 * a1, none)
        a3 = tree.forward_dynamics(q + dt / 2 * v + dt**2 / 4 * a1, v + dt / 2 * a2, none)
        a4 = tree.forward_dynamics(q + dt * v + dt**2 / 2 * a2, v + dt * a3, none)
        q, v = q + dt * v + dt**2 / 6 * (a1 + a2 + a3), v + dt / 6 * (a1 + 2 * a2 + 2 * a3 + a4)


def main(seconds: float = 5.0, repeats: int = 200) -> dict[str, float]:
    """Measure; returns times in microseconds and simulated seconds per second."""
    config = load_config(find_manipulator("single_link"), "geared")
    tree = ReducedTree(config)
    linearize(tree)
    poses = iter(np.random.default_rng(1).uniform(-1.0, 1.0, repeats + 1))
    reduce_s = cpu_times(lambda: reduce_body(config.bodies["strip"], {"root"}), max(repeats // 20, 3))
    serve_s = cpu_times(lambda: linearize(tree, np.array([next(poses)])), repeats)
    plant = Plant(config, 1.0 / config.rate_hz)
    tau = np.array([0.1])
    steps = round(seconds * config.rate_hz)
    plant_s = cpu_times(lambda: [plant.drive(tau) for _ in range(steps)], 1)[0]
    segments = SegmentTree(config, SEGMENTS)
    span = seconds / 20
    segments_s = cpu_times(lambda: simulate_segments(segments, span, SEGMENT_STEP), 1)[0]
    return {
        "reduce_body_median_us": 1e6 * float(np.median(reduce_s)),
        "linearize_median_us": 1e6 * float(np.median(serve_s)),
        "linearize_p99_us": 1e6 * float(np.percentile(serve_s, 99)),
        "plant_simulated_s_per_s": seconds / plant_s,
        "segments_simulated_s_per_s": span / segments_s,
    }


if __name__ == "__main__":
    for name, value in main().items():
        print(f"{name:32} {value:12.1f}")
