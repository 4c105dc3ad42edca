"""Is the filter right where its model is? Many runs of a truth that it models exactly, against chi-square.

The mean of the state's NEES at the end of independent runs, and of every sensor's NIS over all of them (the
innovations of a right filter are white), lie in the 95 % band of chi-square. A machine's bands hold together
with 95 %: each of its k takes 5 %/k. What is drawn has the tails of a Gaussian, so biases are held within no
limit here: a bias beyond its own is a fault on a rig.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from flexarm_bringup.consistency.drawn_truth import Drawn, DrawnTruth, root_of
from flexarm_bringup.consistency.nees import Band, Square, band, mean_of
from flexarm_bringup.tasks.task import Task
from flexarm_estimator.estimator import Estimator
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.settings.overrides import apply_overrides
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
STATE = "state"
START_BEFORE = 0.005  # s; so long before its first step an estimator starts
SMALL = {  # so small that the camera's pose, and a motion with learned parameters, is linear in the state
    "initial_position": 1e-3,
    "initial_velocity": 1e-2,
    "initial_disturbance": 1e-2,
    "motion_acceleration": 1.0,
    "stiffness_error": 0.01,
    "filter": "linear",  # as the truth is
    "gate": 100.0,  # a gate cuts the tails that chi-square has
    "lone_gate": 0.0,
    "lost_sigma": 10.0,
}
UNLIMITED = 100.0  # sigma that a bias may be off by
SWAY, SWAY_HZ = 0.3, 3.0  # torques of the runs as acceleration [rad/s^2 or m/s^2], and how fast they change


@dataclass(frozen=True)
class Drawing:
    """What to draw: a machine's task, number of runs, periods of each, seed; a label, its name if empty."""

    task: Task
    runs: int = 100
    steps: int = 60
    seed: int = 1
    label: str = ""


@dataclass(frozen=True)
class DrawnResult:
    """Means of normalised squares and where they lie by chance, by sensor and for the ``STATE``.

    Attributes:
        name: Of the machine.
        means: Mean per number [1].
        bands: 95 % for all of them together.
    """

    name: str
    means: Mapping[str, float]
    bands: Mapping[str, Band]

    @property
    def outside(self) -> list[str]:
        """What is not in its band."""
        return [name for name, mean in self.means.items() if not self.bands[name].holds(mean)]


class Bench:
    """One machine whose truth is its own model: estimator, truth and torques that go together."""

    def __init__(self, task: Task) -> None:
        """Linearise the machine at home, wherever its task starts."""
        self.config = _unlimited(load_config(find_manipulator(task.manipulator), task.presets[0]))
        self._tree = ReducedTree(self.config)
        self.settings = apply_overrides(EstimatorConfig, {**task.settings.get("estimator", {}), **SMALL})
        self.model: ReducedModel = linearize(self._tree)
        self.dt = 1.0 / self.config.rate_hz
        every = {
            s.name: max(round(self.config.rate_hz / s.rate_hz), 1) for s in self.config.sensors if s.rate_hz
        }
        parts = self.new_estimator().prepare(self.model)
        self.parts = parts
        self.truth = DrawnTruth(parts, {name: every.get(name, 1) for name in parts.sensors.poses})
        self.start = np.zeros(parts.layout.n_x)
        self.start[: self.model.n] = self.model.xi0

    def new_estimator(self) -> Estimator:
        """Return an estimator that has seen nothing."""
        return Estimator(self.model, self._tree, self.config.sensors, self.settings)

    def times(self, steps: int) -> Array:
        """Return instants [s], (steps,)."""
        return np.asarray(np.arange(steps) * self.dt)

    def torques(self, t: Array) -> Array:
        """Return torques that hold the arm and sway it a little, (k, n_theta)."""
        n_theta = self.model.n_theta
        inertia = self.model.M.diagonal()[:n_theta]
        phase = 2 * np.pi * SWAY_HZ * t[:, None] + np.arange(n_theta)
        return np.asarray(self.model.f0[:n_theta] + SWAY * inertia * np.sin(phase))

    def draw(self, steps: int, rng: np.random.Generator | None) -> tuple[Array, Array, Drawn]:
        """Return instants, torques and a run of the truth; without ``rng`` it starts and stays exact."""
        t = self.times(steps)
        tau = self.torques(t)
        start = self.start
        if rng is not None:
            start = start + root_of(self.parts.process.P0) @ rng.standard_normal(start.size)
        return t, tau, self.truth.draw(t, tau, start, START_BEFORE, rng)


def _unlimited(config: ManipulatorConfig) -> ManipulatorConfig:
    """Return an arm whose biases may be as large as they are drawn."""
    sensors = [
        replace(spec, bias=replace(spec.bias, limit=UNLIMITED * spec.bias.sigma)) if spec.bias else spec
        for spec in config.sensors
    ]
    return replace(config, sensors=tuple(sensors))


def run_drawing(drawing: Drawing) -> list[DrawnResult]:
    """Draw and estimate all runs of a machine."""
    bench = Bench(drawing.task)
    rng = np.random.default_rng(drawing.seed)
    seen: dict[str, list[Square]] = {STATE: []}
    for _ in range(drawing.runs):
        t, tau, drawn = bench.draw(drawing.steps, rng)
        estimator = bench.new_estimator()
        for now, torque, samples in zip(t, tau, drawn.samples, strict=True):
            estimate = estimator.step(samples, torque, float(now))
            present = {sample.sensor for sample in samples}
            for report in estimate.sensors:
                if report.name in present:
                    size = report.innovation.size
                    square = Square(size * report.normalised**2, size)
                    seen.setdefault(report.name, []).append(square)
        seen[STATE].append(full_square(drawn.x[-1] - estimate.x, estimate.P))
    share = 1.0 / len(seen)
    bands = {name: band(sum(square.rank for square in squares), share) for name, squares in seen.items()}
    means = {name: mean_of(squares) for name, squares in seen.items()}
    return [DrawnResult(drawing.label or drawing.task.manipulator, means, bands)]


def full_square(e: Array, P: Array) -> Square:
    """Return ``e' P^-1 e`` of a state, whose numbers have very different sizes.

    Args:
        e: Error, (n_x,).
        P: Covariance, (n_x, n_x), positive definite.
    """
    sigma = np.sqrt(P.diagonal())
    L = np.linalg.cholesky(P / np.outer(sigma, sigma))
    white = solve_triangular(L, e / sigma, lower=True)
    return Square(float(white @ white), e.size)
