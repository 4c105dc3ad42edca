"""The truth of a strongly moving arm: the tree's own equation of motion, integrated tightly, without filters.

The arm has as many served modes as it has elastic coordinates, so that ``xi = xi0 + Phi^-1 (q - q0)``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from machines import machine, machine_tree
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from flexarm_estimator.measurement import Measurement
from flexarm_model.numeric.rotation import rotation_vector
from flexarm_model.served.linearize import linearize
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]
ARM = "variable_stiffness"  # three servos, three springs, gravity: its modes turn and change with the pose
FAR = {"low": -100.0, "high": 100.0}  # rad; it swings out of its range, and its encoders count on
SENSORS = tuple(
    replace(spec, bias=None, **(FAR if spec.kind == "encoder" else {})) for spec in machine(ARM).sensors
)
DT = 1.0 / 200.0  # s
SWING = np.array([0.25, 0.15, 0.15])  # N m about what holds the arm at home


@dataclass(frozen=True)
class MovingRecord:
    """A run: instants, torque during the period that ends there, states, samples by instant of exposure.

    Attributes:
        t: (k,).
        tau: (k, n_theta).
        x: [xi; xi'], (k, 2 n).
        tip: T_world_tip, (k, 4, 4).
        samples: Of every instant.
    """

    t: Array
    tau: Array
    x: Array
    tip: Array
    samples: list[list[Measurement]]


@cache
def served() -> ReducedModel:
    """Return the served model at home."""
    return linearize(machine_tree(ARM))


def swing(
    steps: int, rng: np.random.Generator | None = None, dt: float = DT, frame_every: int = 7
) -> MovingRecord:
    """Swing the arm from rest under torques held over every period; with ``rng`` sensors are noisy."""
    tree, model = machine_tree(ARM), served()
    f = tree.functions
    to_xi = np.linalg.inv(model.Phi)
    n = model.n
    z, t = np.concatenate([model.q0, np.zeros(n)]), np.arange(steps + 1) * dt
    tau = model.f0[: model.n_theta] + SWING * np.sin(3.0 * t)[:, None]
    force = np.zeros(n)
    x, tips, samples = [], [], []
    for k in range(steps + 1):
        force[tree.actuated] = tau[k]

        def rate(_: float, z: Array) -> Array:
            return np.concatenate([z[n:], f["forward_dynamics"](z[:n], z[n:], force)])

        if k:
            z = solve_ivp(rate, (0.0, dt), z, rtol=1e-11, atol=1e-12, method="DOP853").y[:, -1]
        a = rate(0.0, z)[n:]
        x.append(np.concatenate([model.xi0 + to_xi @ (z[:n] - model.q0), to_xi @ z[n:]]))
        tips.append(tree.tip_pose(z[:n]))
        y = np.array(f["outputs"](z[:n], z[n:], a, model.q0))
        samples.append(_sample(y, tips[-1], float(t[k]), rng, bool(frame_every and k % frame_every == 0)))
    return MovingRecord(t, tau, np.array(x), np.array(tips), samples)


def _sample(
    y: Array, T: Array, t: float, rng: np.random.Generator | None, has_frame: bool
) -> list[Measurement]:
    names = served().outputs.names
    samples = []
    for spec in SENSORS:
        if spec.kind != "camera":
            value = y[[names.index(f"{spec.name}.{channel}") for channel in spec.channels]]
        elif has_frame:
            value = np.concatenate([T[:3, 3], rotation_vector(T[:3, :3])])
        else:
            continue
        noise = 0.0 if rng is None else np.asarray(spec.sigma) * rng.normal(size=value.size)
        samples.append(Measurement(spec.name, t, value + noise))
    return samples
