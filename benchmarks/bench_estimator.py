"""Cost of one estimator step, beside plain filterpy, plain NumPy and a finite-difference filter.

CPU time of this thread. Three arms: the single link, two flexible links (two_link.yaml: 18 states, 9 rows),
the six-axis robot as served. Samples are drawn from the served model under joint PD: encoders, gauges and
accelerometers in every period, camera frames at their rate and as late as described. A late frame makes the
estimator compute the instants since then again: "late_frame" are ticks with one, "ordinary" those without,
all else is of all ticks. "core" is the joint step in machine code alone.
"""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.bench import load_module
from flexarm_estimator.estimator import Estimator
from flexarm_estimator.filter import Belief
from flexarm_estimator.filters.choice import FilterMaker
from flexarm_estimator.history import Instant
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.parts import Parts
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.steps.step_runner import make_runner
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.numeric.rotation import rotation_vector
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
Action = Callable[["Tick"], object]
WARM_UP = 100  # ticks not counted: caches fill
BANDWIDTH = 10.0  # of the joint PD [rad/s]
SHAKE = 0.5  # acceleration of the reference of the PD [rad/s^2]
FEW = 20  # ticks of the filter by finite differences
IN_A_ROW = 64  # joint steps
TURN = 100  # ticks of one after the other: the machine's speed changes within a second, for all of them
BASELINES = load_module(Path(__file__).with_name("estimator_baselines.py"))
ARMS = ("single_link", "two_link", "serial_6r")


class Tick(NamedTuple):
    """What reaches the estimator in one period."""

    t: float
    u: Array  # [tau; 1]
    rows: Array  # of all sensors that are rows
    samples: list[Measurement]
    replayed: int  # periods since the exposure of a late frame among them; 0 without one


class Arm(NamedTuple):
    """One arm of the benchmark."""

    config: ManipulatorConfig
    tree: ReducedTree
    parts: Parts
    ticks: list[Tick]


def build(name: str, seconds: float) -> Arm:
    """Load an arm and draw what its sensors say."""
    own = Path(__file__).with_name(f"{name}.yaml")
    config = load_config(own if own.exists() else find_manipulator(name))
    tree = ReducedTree(config)
    parts = start(config, tree, EstimatorConfig()).past[0]
    return Arm(config, tree, parts, draw_ticks(config, parts, seconds))


def start(config: ManipulatorConfig, tree: ReducedTree, settings: EstimatorConfig) -> Estimator:
    """Return a new estimator."""
    return Estimator(linearize(tree), tree, config.sensors, settings)


def draw_ticks(config: ManipulatorConfig, parts: Parts, seconds: float) -> list[Tick]:
    """Move the served model under joint PD; frames come when they are as old as described."""
    rng, dt = np.random.default_rng(1), 1.0 / config.rate_hz
    step, model, rows = parts.process.step(dt), parts.model, parts.sensors.rows
    n, n_theta, inertia = model.n, model.n_theta, np.diag(model.M)[: model.n_theta]
    (camera,) = [spec for spec in config.sensors if spec.name in parts.sensors.poses]
    every, late = max(round(1.0 / (camera.rate_hz * dt)), 1), round(camera.latency / dt)
    x = np.append(model.xi0, np.zeros(step.A.shape[0] - n))
    frames: dict[int, Measurement] = {}
    ticks = []
    for k in range(round(seconds / dt)):
        off, speed = x[:n_theta] - model.pose, x[n : n + n_theta]
        pull = SHAKE * np.sin(7.0 * k * dt) - BANDWIDTH**2 * off - 2.0 * BANDWIDTH * speed
        u = np.append(model.f0[:n_theta] + inertia * pull, 1.0)
        x = step.A @ x + step.B @ u
        said = {name: m.C @ x + m.D @ u + _noise(m.R, rng) for name, m in rows.items()}
        samples = [Measurement(name, k * dt, y) for name, y in said.items()]
        if k % every == 0:
            T = parts.tip.pose(x)
            pose = np.concatenate([T[:3, 3], rotation_vector(T[:3, :3])])
            R = parts.sensors.poses[camera.name].R
            frames[k + late] = Measurement(camera.name, k * dt, pose + _noise(R, rng))
        due = [frames[k]] if k in frames else []
        ticks.append(Tick(k * dt, u, np.concatenate([*said.values()]), samples + due, late if due else 0))
    return ticks


def _noise(R: Array, rng: np.random.Generator) -> Array:
    return np.asarray(np.sqrt(np.diag(R)) * rng.normal(size=R.shape[0]))


def time_each(action: Action, ticks: Sequence[Tick]) -> Array:
    """Return the CPU time of every tick [us], (k,); what is there already is never collected, as in nodes."""
    return time_in_turns({"": action}, ticks)[""]


def _clock(action: Action, ticks: Sequence[Tick]) -> Array:
    spent = np.empty(len(ticks))
    for k, tick in enumerate(ticks):
        start = time.thread_time_ns()
        action(tick)
        spent[k] = (time.thread_time_ns() - start) * 1e-3
    return spent


def time_in_turns(actions: dict[str, Action], ticks: Sequence[Tick]) -> dict[str, Array]:
    """Return the CPU time of every tick [us], (k,), of all who take turns."""
    turns = [ticks[k : k + TURN] for k in range(0, len(ticks), TURN)]
    gc.collect()
    gc.freeze()
    spent = [{who: _clock(action, turn) for who, action in actions.items()} for turn in turns]
    gc.unfreeze()
    return {who: np.concatenate([each[who] for each in spent]) for who in actions}


def textbook(arm: Arm) -> Any:
    """Take the matrices out of the parts of an estimator."""
    parts, rows = arm.parts, list(arm.parts.sensors.rows.values())
    step = parts.process.step(1.0 / arm.config.rate_hz)
    H, D = np.vstack([m.C for m in rows]), np.vstack([m.D for m in rows])
    R = np.diag(np.concatenate([np.diag(m.R) for m in rows]))
    x = np.append(parts.model.xi0, np.zeros(step.A.shape[0] - parts.model.n))
    return BASELINES.Textbook(step.A, step.B, step.Q, H, D, R, x, parts.process.P0)


def time_core(arm: Arm, book: Any) -> float:
    """Return the CPU time of the joint step in machine code, one period and all its rows [us]."""
    belief, fusion, prepared = Belief(book.x, book.P), arm.parts.fusion, []
    for tick in arm.ticks[1 : 1 + IN_A_ROW]:
        rows = {sample.sensor: sample for sample in tick.samples if sample.sensor in arm.parts.sensors.rows}
        prepared.append(
            fusion.prepare(belief, 1.0 / arm.config.rate_hz, Instant(tick.t, tick.u, arm.parts, belief, rows))
        )
    runner = make_runner(book.x.size, book.R.shape[0])
    spent = time_each(lambda tick: runner.run(belief, prepared), arm.ticks[:WARM_UP])
    return float(np.median(spent)) / IN_A_ROW


def measure(name: str, seconds: float) -> dict[str, float]:
    """Measure one arm: the estimator with its linear filter, and the baselines."""
    arm = build(name, seconds)
    ticks, book = arm.ticks, textbook(arm)
    estimator = start(arm.config, arm.tree, EstimatorConfig())
    actions: dict[str, Action] = {
        "estimator": lambda tick: estimator.step(tick.samples, tick.u[:-1], tick.t),
        "filterpy": BASELINES.plain_filterpy(book),
        "numpy": BASELINES.plain_numpy(book),
    }
    spent = {who: times[WARM_UP:] for who, times in time_in_turns(actions, ticks).items()}
    late = np.array([tick.replayed > 0 for tick in ticks])[WARM_UP:]
    found = {"states": float(book.x.size), "rows": float(book.R.shape[0]), "core_us": time_core(arm, book)}
    for who, times in spent.items():
        found[f"{who}_median_us"] = float(np.median(times))
        found[f"{who}_p99_us"] = float(np.percentile(times, 99))
        found[f"{who}_ordinary_us"] = float(np.median(times[~late]))
        found[f"{who}_late_frame_us"] = float(np.median(times[late]))
    return {f"{name}_{key}": value for key, value in found.items()}


def measure_moving(name: str, seconds: float) -> dict[str, float]:
    """Measure the extended filter and the one by finite differences, over ticks without frames."""
    arm = build(name, seconds)
    ticks, book = [tick for tick in arm.ticks if not tick.replayed], textbook(arm)
    moving = EstimatorConfig(filter="extended")
    flow = FilterMaker(arm.tree, moving).flow(arm.parts.model, arm.parts.process, arm.parts.sensors)
    differences = BASELINES.finite_differences(book, flow, 1.0 / arm.config.rate_hz)
    extended = start(arm.config, arm.tree, moving)
    ours = time_each(lambda tick: extended.step(tick.samples, tick.u[:-1], tick.t), ticks[: 3 * WARM_UP])
    theirs = time_each(differences, ticks[:FEW])
    return {
        f"{name}_extended_median_us": float(np.median(ours)),
        f"{name}_finite_difference_median_us": float(np.median(theirs)),
    }


def measure_losses(name: str, seconds: float) -> dict[str, float]:
    """Measure the step with a robust loss over its horizon."""
    arm, robust = build(name, seconds), EstimatorConfig(loss="huber")
    estimator = start(arm.config, arm.tree, robust)
    spent = time_each(
        lambda tick: estimator.step(tick.samples, tick.u[:-1], tick.t), arm.ticks[: 3 * WARM_UP]
    )[WARM_UP:]
    return {
        f"{name}_huber_median_us": float(np.median(spent)),
        f"{name}_huber_p99_us": float(np.percentile(spent, 99)),
    }


def main(seconds: float = 20.0) -> dict[str, float]:
    """Measure; returns sizes, times in microseconds and ratios."""
    found: dict[str, float] = {}
    for name in ARMS:
        found |= measure(name, seconds)
    found |= measure_moving("two_link", seconds) | measure_losses("single_link", seconds)
    differences = found["two_link_finite_difference_median_us"]
    found["ratio_finite_difference_to_step"] = differences / found["two_link_estimator_ordinary_us"]
    found["ratio_finite_difference_to_extended"] = differences / found["two_link_extended_median_us"]
    return found


if __name__ == "__main__":
    for key, value in main().items():
        print(f"{key:44} {value:12.1f}")
