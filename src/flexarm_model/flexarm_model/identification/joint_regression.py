"""Friction, rotor inertia and gear stiffness of the joints from motion, by linear regression on the dynamics.

Torque of a motor's axis, and balance at a sprung one whose deflection ``q`` is measured::

    tau = sum_i s_i Y_i phi_i + I a + b v + c tanh(v / v_s) + o + k q
      0 = sum_i s_i Y_i phi_i + k q + d v

with links as described times ``s_i``, rotor inertia I, viscous and Coulomb friction b, c, an offset o (of
the torque, or what gravity is not told), stiffness k (of a motor's axis where one is described) and damping
d. Positions are differentiated after a low-pass; then regressors and torques go through one more, far below
the modes of the arm, alike, so that it changes none of the parameters [Gautier1997]. Every parameter has a
prior, so that what the motion does not tell stays where it was; how much it tells is its sigma over that
before, and the condition number of the scaled regressor. A motor that stands tells nothing, and sigma holds
what bending puts into a parameter (``bending``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from flexarm_model.identification.bending import Balance, missing_torque
from flexarm_model.identification.encoder_noise import ORDER, left_behind, smoothest, white_noise
from flexarm_model.identification.joint_columns import OFFSET, SLOPE, JointColumn, joint_columns
from flexarm_model.identification.regressor_quality import balance_sizes, condition, weakest
from flexarm_model.identification.rigid_limit import RigidLimit
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.modal.read_only import lock_arrays
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
SMOOTHER, LEAST_SMOOTHER = 25.0, 5.0  # cut-off of positions over the regression's: friction rings the modes
EDGES = 1.0  # of the regression's cut-off: this many periods at both ends do not count
IDENTIFIED = 0.5  # of the sigma before, up to which a parameter counts as told
SIGNIFICANT, NEGLIGIBLE = 3.0, 0.05  # sigmas, and sigmas before
STANDS_OUT = 5.0  # of the deviation of its noise: least RMS of a motor's velocity or acceleration
NYQUIST_SHARE = 0.8
Motion = tuple[Array, Array, Array]  # positions, velocities, accelerations, or their variances


@dataclass(frozen=True)
class JointMotion:
    """Measured motion of an arm.

    Attributes:
        axes: Axes "joint.axis" whose positions are measured.
        q: Positions at the samples [rad or m], (n, n_axes).
        tau: Torque at the samples, zero for axes without motor, (n, n_axes).
        dt: Sample period [s].
        is_held: The torque acts from each sample to the next, as a drive holds it; else at the samples.
    """

    axes: tuple[str, ...]
    q: Array
    tau: Array
    dt: float
    is_held: bool = True

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
        sigma: One sigma of it, with the bias.
        prior: One sigma before.
        bias: What bending of the arm as described puts into it, since the regression takes it for rigid.
    """

    axis: str
    name: str
    unit: str
    described: float
    value: float
    sigma: float
    prior: float
    bias: float = 0.0

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
        fit: Share of the torque that is explained, by axis [%], not a number for a motor without, (n_axes,).
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


def identify_joints(
    config: ManipulatorConfig, motion: JointMotion, cutoff_hz: float, tree: ReducedTree | None = None
) -> JointResult:
    """Return the parameters of the joints.

    Args:
        config: The manipulator as described.
        motion: What was measured.
        cutoff_hz: Of the regression; well below the slowest mode [Hz].
        tree: Its dynamics, of which the bias comes; None for an arm that does not bend.

    Raises:
        ValueError: The motion is too short or not finite, or the arm is not an open one.
        PoseError: There is no model of the tree at the mean pose.
    """
    if not (np.isfinite(motion.q).all() and np.isfinite(motion.tau).all()):
        raise ValueError(f"positions or torques of {', '.join(motion.axes)} are not finite at some samples")
    rigid, dt = RigidLimit(config, motion.axes), motion.dt
    sigma = white_noise(motion.q)
    noise = left_behind(sigma, cutoff_hz, dt)
    moved = _derivatives(motion, cutoff_hz, smoothest(sigma, dt, SLOPE))
    moved = _standing(config, motion, moved, noise, cutoff_hz)
    acting = motion.tau - motion.is_held * np.diff(motion.tau, axis=0, prepend=motion.tau[:1]) / 2
    columns, X = joint_columns(config, rigid, moved, acting, noise)
    edge = round(EDGES / cutoff_hz / dt)
    kept = slice(edge, len(X) - edge, max(1, int(0.5 / cutoff_hz / dt)))
    X, y = _lowpass(X, cutoff_hz, dt)[kept], _lowpass(acting, cutoff_hz, dt)[kept]
    if y.size < 2 * len(columns):
        raise ValueError(f"{len(motion.q) * dt:.1f} s of motion are too short for {len(columns)} parameters")
    described = np.array([column.described for column in columns])
    bent = np.zeros_like(y)
    if tree is not None:
        slow = [_lowpass(part, cutoff_hz, dt) for part in moved]
        bent = missing_torque(tree, motion.axes, _rigid_balance(config, rigid, described), slow, dt)[kept]
    size = balance_sizes(described, X, y)
    parameters, fit = _solve(columns, X, y, bent, size)
    moving = np.mean(abs(moved[1][kept]) > SLOPE, axis=0)
    acceleration = np.sqrt(np.mean(moved[2][kept] ** 2, axis=0))
    least = weakest([f"{column.axis} {column.name}" for column in columns], X, size)
    unasked = [config.axes[name].actuated and not y[:, k].any() for k, name in enumerate(motion.axes)]
    fit = np.where(unasked, np.nan, fit)
    return JointResult(parameters, condition(X, size), fit, moving, acceleration, least)


def _standing(
    config: ManipulatorConfig, motion: JointMotion, moved: Motion, noise: Motion, cutoff_hz: float
) -> Motion:
    """Return the motion with motors at rest that stand, or where nothing stands out of the encoder's noise.

    A loop that holds a motor answers the noise of its encoder: the torque of a motor that stands and that
    noise together look like an inertia or a friction, be it a negative one.
    """
    slow = [_lowpass(part, cutoff_hz, motion.dt) for part in moved[1:]]
    squares = [np.mean(part**2, axis=0) for part in slow]
    actuated = np.array([config.axes[name].actuated for name in motion.axes])
    stands = squares[0] <= SLOPE**2
    v, a = (
        np.where(actuated & (stands | (square <= STANDS_OUT**2 * variance)), 0.0, part)
        for part, square, variance in zip(moved[1:], squares, noise[1:], strict=True)
    )
    return moved[0], v, a


def _rigid_balance(config: ManipulatorConfig, rigid: RigidLimit, described: Array) -> Balance:
    """Return what the rigid arm with described parameters asks of its axes."""

    def balance(q: Array, v: Array, a: Array) -> Array:
        """Return it for positions, velocities, accelerations, (n, n_axes)."""
        none = np.zeros_like(q)
        X = joint_columns(config, rigid, (q, v, a), none, (none[0], none[0]))[1]
        return np.asarray(X @ described)

    return balance


def _derivatives(motion: JointMotion, cutoff_hz: float, surest_hz: float) -> tuple[Array, Array, Array]:
    """Return positions, velocities and accelerations behind the widest low-pass that noise allows."""
    smoother = np.clip(surest_hz, LEAST_SMOOTHER * cutoff_hz, SMOOTHER * cutoff_hz)
    q = _lowpass(motion.q, float(smoother), motion.dt)
    v = np.gradient(q, motion.dt, axis=0)
    a = np.zeros_like(q)
    a[1:-1] = np.diff(q, n=2, axis=0) / motion.dt**2
    return q, v, a


def _solve(
    columns: Sequence[JointColumn], X: Array, y: Array, bent: Array, size: Array
) -> tuple[tuple[JointParameter, ...], Array]:
    """Return parameters and fit; every axis counts by its own residual.

    What ``bent`` [N m or N], (n, n_axes), of the torque is not the rigid arm's goes into sigma as a bias.
    """
    described, prior = (np.array([getattr(c, name) for c in columns]) for name in ("described", "prior"))
    sigma = np.maximum(np.std(y - X @ described, axis=0), 1e-12)  # per axis, (n_axes,)
    for _ in range(3):
        weights, blur = sigma, _blur(columns, X, sigma)
        rows = (X / weights[:, None]).reshape(-1, len(columns))
        information = rows.T @ rows - blur + np.diag(prior**-2)
        told = rows.T @ ((y - X @ described) / sigma).ravel() + blur @ described
        delta = np.linalg.solve(information, told)
        left = y - X @ (described + delta)
        sigma = np.maximum(np.std(left, axis=0), 1e-9 * size + 1e-15)
    bias = np.linalg.solve(information, rows.T @ (bent / weights).ravel())
    spread = np.hypot(np.sqrt(np.diag(np.linalg.inv(information))), bias)
    found = tuple(
        JointParameter(
            c.axis, c.name, c.unit, c.described, float(c.described + d), float(s), c.prior, float(b)
        )
        for c, d, s, b in zip(columns, delta, spread, bias, strict=True)
    )
    return found, np.asarray(100.0 * (1.0 - np.std(left, axis=0) / size))


def _blur(columns: Sequence[JointColumn], X: Array, sigma: Array) -> Array:
    """Return what noise in the regressors adds to the information, at most half of it, (n_c, n_c)."""
    added = np.zeros(len(columns))
    for i, column in enumerate(columns):
        k = int(np.argmax(np.sum(X[:, :, i] ** 2, axis=0)))  # the one axis of a column with noise
        square = float(np.sum(X[:, k, i] ** 2))
        added[i] = min(len(X) * column.noise, 0.5 * square) / sigma[k] ** 2
    return np.diag(added)


def _lowpass(signal: Array, cutoff_hz: float, dt: float) -> Array:
    sections = scipy.signal.butter(ORDER, min(2 * cutoff_hz * dt, NYQUIST_SHARE), output="sos")
    return np.asarray(scipy.signal.sosfiltfilt(sections, signal, axis=0))
