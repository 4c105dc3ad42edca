"""Friction, rotor inertia and gear stiffness of the joints from motion, by linear regression on the dynamics.

Torque of a motor's axis, and balance at a sprung one whose deflection ``q`` is measured::

    tau = sum_i s_i Y_i phi_i + I a + b v + c tanh(v / v_s) + o + k q
      0 = sum_i s_i Y_i phi_i + k q + d v

with links as described times ``s_i``, rotor inertia I, viscous and Coulomb friction b, c, an offset o (of
the torque, or what gravity is not told), stiffness k (of a motor's axis where one is described) and damping
d. Positions are differentiated after a low-pass; then regressors and torques go through one more, far below
the modes of the arm, alike, so that it changes none of the parameters [Gautier1997]. Every parameter has a
prior, so that what the motion does not tell stays where it was; how much it tells is its sigma over that
before, and the condition number of the scaled regressor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from flexarm_model.identification.encoder_noise import ORDER, left_behind, smoothest, white_noise
from flexarm_model.identification.regressor_quality import balance_sizes, condition, weakest
from flexarm_model.identification.rigid_limit import RigidLimit
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.modal.read_only import lock_arrays
from flexarm_model.settings.units import axis_dimension, si_unit

Array = NDArray[np.float64]
SMOOTHER, LEAST_SMOOTHER = 25.0, 5.0  # cut-off of positions over the regression's: friction rings the modes
EDGES = 1.0  # of the regression's cut-off: this many periods at both ends do not count
SLOPE = 0.01  # velocity over which Coulomb friction turns its sign [rad/s or m/s]
LINK_SPREAD = 0.02  # one sigma of a link's relative error
IDENTIFIED = 0.5  # of the sigma before, up to which a parameter counts as told
LEAST, LEAST_TORQUE = 1e-6, 1e-9  # SI; a sigma before, where description or motion says 0
SIGNIFICANT, NEGLIGIBLE = 3.0, 0.05  # sigmas, and sigmas before
OFFSET = "offset"  # the one parameter of an axis that may be negative
NYQUIST_SHARE = 0.8


@dataclass(frozen=True)
class JointMotion:
    """Measured motion of an arm.

    Attributes:
        axes: Axes "joint.axis" whose positions are measured.
        q: Positions at the samples [rad or m], (n, n_axes).
        tau: Torque that acts from each sample to the next, zero for axes without motor, (n, n_axes).
        dt: Sample period [s].
    """

    axes: tuple[str, ...]
    q: Array
    tau: Array
    dt: float

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        lock_arrays(self)


@dataclass(frozen=True)
class JointParameter:
    """A parameter and what the motion says of it.

    Attributes:
        axis: "joint.axis".
        name: What it is.
        unit: SI.
        described: Value before.
        value: Value found.
        sigma: One sigma of it.
        prior: One sigma before.
    """

    axis: str
    name: str
    unit: str
    described: float
    value: float
    sigma: float
    prior: float

    @property
    def is_told(self) -> bool:
        """The motion has told it."""
        return self.sigma <= IDENTIFIED * self.prior

    @property
    def is_impossible(self) -> bool:
        """It is below zero by more than its uncertainty and what a description may leave out."""
        least = max(SIGNIFICANT * self.sigma, NEGLIGIBLE * self.prior)
        return self.name != OFFSET and self.is_told and self.value < -least


@dataclass(frozen=True)
class JointResult:
    """Parameters of all joints, and how well the motion was suited.

    Attributes:
        parameters: In the order of the axes.
        condition: Condition number of the regressor, columns scaled to one [1].
        fit: Share of the torque that is explained, by axis [%], (n_axes,).
        moving: Share of the time in which an axis moves faster than friction turns [1], (n_axes,).
        acceleration: RMS of the accelerations used [rad/s^2 or m/s^2], (n_axes,).
        weakest: Combination that the motion tells least, in words.
    """

    parameters: tuple[JointParameter, ...]
    condition: float
    fit: Array
    moving: Array
    acceleration: Array
    weakest: str


@dataclass(frozen=True)
class _Column:
    """An unknown: axis, name, unit, value and sigma before; variance of noise in its regressor."""

    axis: str
    name: str
    unit: str
    described: float
    prior: float
    noise: float = 0.0


def identify_joints(config: ManipulatorConfig, motion: JointMotion, cutoff_hz: float) -> JointResult:
    """Return the parameters of the joints.

    Args:
        config: The manipulator as described.
        motion: What was measured.
        cutoff_hz: Of the regression; well below the slowest mode [Hz].

    Raises:
        ValueError: The motion is too short or not finite, or the arm is not an open one.
    """
    if not (np.isfinite(motion.q).all() and np.isfinite(motion.tau).all()):
        raise ValueError(f"positions or torques of {', '.join(motion.axes)} are not finite at some samples")
    rigid = RigidLimit(config, motion.axes)
    sigma = white_noise(motion.q)
    q, v, a = _derivatives(motion, cutoff_hz, smoothest(sigma, motion.dt, SLOPE))
    acting = (motion.tau + np.vstack([motion.tau[:1], motion.tau[:-1]])) / 2  # at the samples
    columns, X = _regressors(config, rigid, (q, v, a), acting, left_behind(sigma, cutoff_hz, motion.dt))
    step = max(1, int(0.5 / cutoff_hz / motion.dt))
    edge = round(EDGES / cutoff_hz / motion.dt)
    kept = slice(edge, len(q) - edge, step)
    X, y = _lowpass(X, cutoff_hz, motion.dt)[kept], _lowpass(acting, cutoff_hz, motion.dt)[kept]
    if y.size < 2 * len(columns):
        raise ValueError(f"{len(q) * motion.dt:.1f} s of motion are too short for {len(columns)} parameters")
    size = balance_sizes(np.array([column.described for column in columns]), X, y)
    parameters, fit = _solve(columns, X, y, size)
    moving, acceleration = np.mean(abs(v[kept]) > SLOPE, axis=0), np.sqrt(np.mean(a[kept] ** 2, axis=0))
    least = weakest([f"{column.axis} {column.name}" for column in columns], X, size)
    return JointResult(parameters, condition(X, size), fit, moving, acceleration, least)


def _derivatives(motion: JointMotion, cutoff_hz: float, surest_hz: float) -> tuple[Array, Array, Array]:
    """Return positions, velocities and accelerations behind the widest low-pass that noise allows."""
    smoother = np.clip(surest_hz, LEAST_SMOOTHER * cutoff_hz, SMOOTHER * cutoff_hz)
    q = _lowpass(motion.q, float(smoother), motion.dt)
    v = np.gradient(q, motion.dt, axis=0)
    a = np.zeros_like(q)
    a[1:-1] = np.diff(q, n=2, axis=0) / motion.dt**2
    return q, v, a


def _regressors(
    config: ManipulatorConfig,
    rigid: RigidLimit,
    motion: tuple[Array, Array, Array],
    tau: Array,
    noise: tuple[Array, Array],
) -> tuple[list[_Column], Array]:
    """Return the unknowns and their columns, (n, n_axes, n_columns).

    A motor's torque is what its regressors explain, a spring's balance has no torque: only there the noise
    that is left of positions and velocities counts.
    """
    q, v, a = motion
    links = np.array([rigid.torques(*row) for row in zip(q, v, a, strict=True)])  # (n, n_axes, n_bodies)
    columns = [_Column(name, "links beyond, over described", "1", 1.0, LINK_SPREAD) for name in rigid.bodies]
    parts = [links]
    for k, name in enumerate(rigid.axes):
        axis, size = config.axes[name], max(float(np.sqrt(np.mean(tau[:, k] ** 2))), LEAST_TORQUE)
        speed = float(np.sqrt(np.mean(v[:, k] ** 2)))
        if axis.actuated:
            own = {
                ("rotor inertia", "inertia"): (a, axis.rotor_inertia, max(axis.rotor_inertia, LEAST)),
                ("viscous friction", "damping"): (v, axis.damping, size / max(speed, SLOPE)),
                ("Coulomb friction", "effort"): (np.tanh(v / SLOPE), 0.0, size),
                (OFFSET, "effort"): (np.ones_like(v), 0.0, size),
            }
            if axis.stiffness:
                own["stiffness", "stiffness"] = q, axis.stiffness, axis.stiffness
        else:
            own = {
                ("stiffness", "stiffness"): (q, axis.stiffness, max(axis.stiffness, LEAST)),
                ("damping", "damping"): (v, axis.damping, 10.0 * max(axis.damping, LEAST)),
            }
        blurs = {} if axis.actuated else {"stiffness": noise[0][k], "damping": noise[1][k]}
        for (what, quantity), (values, described, prior) in own.items():
            unit = si_unit(axis_dimension(axis.name, quantity))
            column = np.zeros((len(q), len(rigid.axes), 1))
            column[:, k, 0] = values[:, k]
            parts.append(column)
            columns.append(_Column(name, what, unit, described, prior, float(blurs.get(what, 0.0))))
    return columns, np.concatenate(parts, axis=2)


def _solve(
    columns: Sequence[_Column], X: Array, y: Array, size: Array
) -> tuple[tuple[JointParameter, ...], Array]:
    """Return parameters and fit; every axis counts by its own residual."""
    described, prior = (np.array([getattr(c, name) for c in columns]) for name in ("described", "prior"))
    sigma = np.maximum(np.std(y - X @ described, axis=0), 1e-12)  # per axis, (n_axes,)
    for _ in range(3):
        rows, blur = (X / sigma[:, None]).reshape(-1, len(columns)), _blur(columns, X, sigma)
        information = rows.T @ rows - blur + np.diag(prior**-2)
        told = rows.T @ ((y - X @ described) / sigma).ravel() + blur @ described
        delta = np.linalg.solve(information, told)
        left = y - X @ (described + delta)
        sigma = np.maximum(np.std(left, axis=0), 1e-9 * size + 1e-15)
    spread = np.sqrt(np.diag(np.linalg.inv(information)))
    found = tuple(
        JointParameter(c.axis, c.name, c.unit, c.described, float(c.described + d), float(s), c.prior)
        for c, d, s in zip(columns, delta, spread, strict=True)
    )
    return found, np.asarray(100.0 * (1.0 - np.std(left, axis=0) / size))


def _blur(columns: Sequence[_Column], X: Array, sigma: Array) -> Array:
    """Return what noise in the regressors adds to the information, at most half of it, (n_c, n_c)."""
    added = np.zeros(len(columns))
    for i, column in enumerate(columns):
        k = int(np.argmax(np.sum(X[:, :, i] ** 2, axis=0)))  # the one axis of a column with noise
        square = float(np.sum(X[:, k, i] ** 2))
        added[i] = min(len(X) * column.noise, 0.5 * square) / sigma[k] ** 2
    return np.diag(added)


def _lowpass(signal: Array, cutoff_hz: float, dt: float) -> Array:
    cutoff = min(2 * cutoff_hz * dt, NYQUIST_SHARE)
    return np.asarray(sosfiltfilt(butter(ORDER, cutoff, output="sos"), signal, axis=0))
