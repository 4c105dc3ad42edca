"""A single link of about the numbers of seed 002, in closed form: model, kinematics, sensors, truth.

The estimator's tests use it instead of the real model, so that they check the estimator alone. Tree
coordinates are the served ones, q = xi; the tip is ``R(theta) [L; phi eta]``, turned by ``slope eta``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.estimate import Estimate
from flexarm_estimator.estimator import Estimator
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.state.process import ProcessModel
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.manipulator.sensor_spec import SensorSpec
from flexarm_model.numeric.rotation import rotation_vector
from flexarm_model.reading.config import load_config
from flexarm_model.served.reduced_model import Outputs, ReducedModel
from flexarm_model.tree.borne_load import BorneLoad, borne_load

Array = NDArray[np.float64]
F_HZ = np.array([5.230, 36.22, 106.3])
G_PHI = np.array([0.6854, -0.0685, 0.0180])  # sensor motion per hub acceleration, seed 002
PHI = np.array([2.98, -2.2, 2.1])  # modes at the sensor [kg^-0.5]
SLOPE = np.array([6.5, -14.0, 22.0])
STRAIN = np.array([0.0265, -0.15, 0.38])
LENGTH, REACH = 0.64, 0.63  # m: tip and accelerometer from the axis
POSE = ("tx", "ty", "tz", "rx", "ry", "rz")
DT = 1.0 / 200.0  # s

ENCODER = SensorSpec(
    "encoder", "encoder", "base.rz", ("position",), np.array([20e-6]), low=-100.0, high=100.0
)
STRAIN_GAUGE = SensorSpec(
    "root_strain", "strain_gauge", "strip.gauge", ("strain",), np.array([1e-6]), low=-0.02, high=0.02
)
ACCELEROMETER = SensorSpec(
    "tip_accelerometer", "accelerometer", "strip.sensor", ("y",), np.array([0.03]), low=-490.0, high=490.0
)
CAMERA = SensorSpec(
    "camera", "camera", "strip.tip", POSE, np.array([5e-4] * 3 + [5e-3] * 3), 30.0, 0.06, -100.0, 100.0
)
SENSORS = (ENCODER, STRAIN_GAUGE, ACCELEROMETER, CAMERA)
ROW_SENSORS = SENSORS[:3]


def strip_model(hub_inertia: float = 0.30, frequency_scale: float = 1.0, zeta: float = 0.015) -> ReducedModel:
    """Return the served model of the strip about theta = 0."""
    omega = 2 * np.pi * F_HZ * frequency_scale
    M = np.eye(4)
    M[0, 0] = hub_inertia + 0.0648
    M[0, 1:] = M[1:, 0] = G_PHI / PHI
    D, K = np.zeros((4, 4)), np.zeros((4, 4))
    D[1:, 1:], K[1:, 1:] = np.diag(2 * zeta * omega), np.diag(omega**2)
    names = ("encoder.position", "root_strain.strain", "tip_accelerometer.y", *(f"tip.{c}" for c in POSE))
    units = ("rad", "1", "m/s^2", "m", "m", "m", "rad", "rad", "rad")
    C_pos, C_acc, y0 = np.zeros((9, 4)), np.zeros((9, 4)), np.zeros(9)
    C_pos[0, 0], C_pos[1, 1:] = 1.0, STRAIN
    C_pos[4], C_pos[8] = [LENGTH, *PHI], [1.0, *SLOPE]
    C_acc[2] = [REACH, *PHI]
    y0[3] = LENGTH
    outputs = Outputs(names, units, y0, C_pos, np.zeros((9, 4)), C_acc)
    B = np.eye(4)[:, :1].copy()
    return ReducedModel(
        "single_link", "planar", ("base.rz",), np.zeros(1), M, D, K, B, np.zeros(4),
        omega, np.full(3, zeta), outputs, np.zeros(4), np.eye(4),
    )  # fmt: skip


class StripKinematics:
    """Tip of the strip in closed form."""

    def tip_pose(self, q: Array) -> Array:
        """Return T_world_tip, (4, 4)."""
        c, s, w = np.cos(q[0]), np.sin(q[0]), PHI @ q[1:]
        angle = q[0] + SLOPE @ q[1:]
        T = np.eye(4)
        T[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        T[:2, 3] = [c * LENGTH - s * w, s * LENGTH + c * w]
        return T

    def tip_jacobian(self, q: Array) -> Array:
        """Return the Jacobian [linear; angular], (6, 4)."""
        c, s, w = np.cos(q[0]), np.sin(q[0]), PHI @ q[1:]
        J = np.zeros((6, 4))
        J[0], J[1] = [-s * LENGTH - c * w, *(-s * PHI)], [c * LENGTH - s * w, *(c * PHI)]
        J[5] = [1.0, *SLOPE]
        return J

    def mass_matrix(self, q: Array) -> Array:
        """Return M of the strip, (4, 4)."""
        return np.array(strip_model().M)

    def borne(self, q: Array) -> BorneLoad:
        """Return what it bears being bent as at q; all of its modes are served."""
        C = strip_model().outputs.C_pos
        return borne_load(strip_model().K @ q, strip_model().K, np.eye(4)[:, 1:], C)


def camera_sample(x: Array, t: float) -> Measurement:
    """Return the camera's exact sample of state ``x``."""
    T = StripKinematics().tip_pose(x[:4])
    return Measurement("camera", t, np.concatenate([T[:3, 3], rotation_vector(T[:3, :3])]))


@dataclass(frozen=True)
class Record:
    """A run of the truth: instants k = 0..n, torque during the period that ends there, states, samples.

    Attributes:
        t: (n + 1,).
        tau: (n + 1, 1).
        x: (n + 1, 9).
        samples: Of every instant.
    """

    t: Array
    tau: Array
    x: Array
    samples: list[list[Measurement]]


def simulate(
    steps: int,
    rng: np.random.Generator | None = None,
    x0: Array | None = None,
    model: ReducedModel | None = None,
    config: EstimatorConfig | None = None,
    camera_every: int = 0,
) -> Record:
    """Run the linear model; with ``rng`` also process and sensor noise, correlated as modelled.

    Args:
        steps: Number of periods.
        rng: None for a run without any noise.
        x0: State at the first instant, (9,).
        model: Served model of the truth.
        config: Settings that give the noise.
        camera_every: Instants between camera frames, 0 for none; a frame is filed at its exposure.
    """
    model = strip_model() if model is None else model
    process = ProcessModel(model, EstimatorConfig() if config is None else config)
    system, step = process.system, process.step(DT)
    rows = [0, 1, 2]
    C, D, D_w = system.C[rows], np.column_stack([system.D[rows], system.y_c[rows]]), system.D_w[rows]
    sigma = np.concatenate([spec.sigma for spec in ROW_SENSORS])
    cross = step.force_cross @ D_w.T
    joint = np.block([[step.Q, cross], [cross.T, np.diag(sigma**2) + D_w @ process.force_cov @ D_w.T]])
    t = np.arange(steps + 1) * DT
    tau = np.column_stack([2.0 * np.sin(7.0 * t) + 0.5 * np.sign(np.sin(31.0 * t))])
    x = np.zeros((steps + 1, 9))
    x[0] = np.zeros(9) if x0 is None else x0
    samples: list[list[Measurement]] = []
    root = _root(joint)
    for k in range(steps + 1):
        noise = np.zeros(12) if rng is None else root @ rng.normal(size=12)
        u = np.array([tau[k, 0], 1.0])
        if k:
            x[k] = step.A @ x[k - 1] + step.B @ u + noise[:9]
        y = C @ x[k] + D @ u + noise[9:]
        now = [Measurement(spec.name, t[k], y[i : i + 1]) for i, spec in enumerate(ROW_SENSORS)]
        if camera_every and k % camera_every == 0:
            frame = camera_sample(x[k], float(t[k]))
            y_camera = frame.y + (0.0 if rng is None else CAMERA.sigma * rng.normal(size=6))
            now.append(Measurement("camera", frame.t, y_camera))
        samples.append(now)
    return Record(t, tau, x, samples)


def only(samples: Sequence[Measurement], *sensors: str) -> list[Measurement]:
    """Return the samples of some sensors."""
    return [sample for sample in samples if sample.sensor in sensors]


def _root(P: Array) -> Array:
    """Return the symmetric root: the signs of eigenvectors differ from processor to processor."""
    scale = np.sqrt(np.diag(P))
    values, vectors = np.linalg.eigh(P / np.outer(scale, scale))
    return scale[:, None] * ((vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T)


def run(
    record: Record,
    model: ReducedModel | None = None,
    sensors: Sequence[SensorSpec] = SENSORS,
    config: EstimatorConfig | None = None,
    camera_delay: int = 0,
    camera_until: float = np.inf,
) -> list[Estimate]:
    """Feed a record to a new estimator; frames arrive ``camera_delay`` instants after exposure."""
    config = EstimatorConfig() if config is None else config
    estimator = Estimator(
        strip_model() if model is None else model, StripKinematics(), tuple(sensors), config
    )
    return [
        estimator.step(arriving(record, k, camera_delay, camera_until), record.tau[k], float(record.t[k]))
        for k in range(len(record.t))
    ]


def arriving(
    record: Record, k: int, camera_delay: int = 0, camera_until: float = np.inf
) -> list[Measurement]:
    """Return what arrives at instant ``k``."""
    now = [sample for sample in record.samples[k] if sample.sensor != "camera"]
    frames = only(record.samples[k - camera_delay], "camera") if k >= camera_delay else []
    return now + [frame for frame in frames if frame.t <= camera_until]


@cache
def single_link(preset: str = "geared") -> ManipulatorConfig:
    """Return the description of the arm that flexarm ships."""
    folder = Path(__file__).parents[2] / "flexarm_bringup/config/manipulators"
    return load_config(folder / "single_link.yaml", preset)
