"""Modes of a description with changed values at a pose, from the same linear model that is served.

Gravity bends and stiffens and loops are closed at the pose, as in ``linearize``, but no mode is left out. Its
dynamics are not compiled: they are needed once per set of values.

A measurement shows poles, so frequencies, damping ratios and shapes are those of the damped arm, and what
does not oscillate is no mode. Every body has a mode more than it keeps: those served are enough for the arm
with motors that hold, but a 3RRR whose motors give way has its third triplet 2.3 % slower than they tell.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from flexarm_model.bodies.body_reduction import KeptReductions
from flexarm_model.bodies.model_order import with_more_modes
from flexarm_model.modal.read_only import lock_arrays
from flexarm_model.reading.config import load_config
from flexarm_model.served.linearize import linearize
from flexarm_model.served.reduced_model import Outputs
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
Changes = Mapping[str, str | float]
RIGID_HZ = 1e-3  # below it a mode is the free motion of a motor
ROUNDING = 1e-7  # of the fastest frequency: below it a frequency is rounding
MORE_MODES = 1  # per body than the description keeps
KEPT = 256  # answers: those of a fit's derivatives are asked for again when it ends


@dataclass(frozen=True)
class ArmModes:
    """Oscillating modes of an arm at a pose, slowest first; the free motion of a motor is none.

    Attributes:
        omega: Magnitudes of the poles [rad/s], (r,).
        zeta: Damping ratios [1], (r,).
        shapes: Real parts, turned to hold most of the shape, in the coordinates of ``outputs``, of modal mass
            one, (n, r).
        outputs: What the sensors see of the coordinates.
    """

    omega: Array
    zeta: Array
    shapes: Array
    outputs: Outputs

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        lock_arrays(self)


class DescribedArm:
    """A description whose values change; an answer that was given is kept."""

    def __init__(
        self,
        path: Path,
        preset: str,
        motors_locked: bool,
        on_model: Callable[[int], None] = lambda count: None,
    ) -> None:
        """Take a description.

        Args:
            path: Its file.
            preset: Its preset.
            motors_locked: Modes with the actuated axes held, as under a brake, instead of free.
            on_model: Is told the number of every model before it is made, from 1 on.
        """
        self._on_model, self._count = on_model, 0
        self._path, self._preset, self._motors_locked = path, preset, motors_locked
        self._given: dict[tuple[object, ...], ArmModes] = {}
        self._last: tuple[object, ReducedTree] | None = None
        self._reduce = KeptReductions()  # those of finite elements take longer than all the rest

    def modes(self, changes: Changes, pose: Array) -> ArmModes:
        """Return the modes of the changed arm at a pose [rad or m], (n_theta,).

        Raises:
            ConfigError: A value cannot be changed as asked.
            PoseError, ClosureError: There is no model at this pose.
        """
        values = tuple(sorted(changes.items()))
        key = (values, tuple(map(float, pose)))
        if key not in self._given:
            if len(self._given) >= KEPT:
                self._given.pop(next(iter(self._given)))
            self._count += 1
            self._on_model(self._count)
            self._given[key] = arm_modes(self._tree(values), pose, self._motors_locked)
        return self._given[key]

    def _tree(self, values: tuple[tuple[str, str | float], ...]) -> ReducedTree:
        """Return the dynamics; poses are asked for one after the other of the same values."""
        if self._last is None or self._last[0] != values:
            config = with_more_modes(load_config(self._path, self._preset, dict(values)), MORE_MODES)
            self._last = values, ReducedTree(config, use_compiler=False, reduce=self._reduce)
        return self._last[1]


def arm_modes(tree: ReducedTree, pose: Array | None, motors_locked: bool) -> ArmModes:
    """Return all modes of an arm at a pose.

    Args:
        tree: Its dynamics.
        pose: Actuated axes [rad or m], (n_theta,); None is the home pose.
        motors_locked: With the actuated axes held instead of free.

    Raises:
        PoseError, ClosureError: There is no model at this pose.
    """
    every = tree.n_q - tree.loops.dependent.size - len(tree.actuated)
    model = linearize(tree, pose, every)
    first = model.n_theta if motors_locked else 0
    M, D, K = (matrix[first:, first:] for matrix in (model.M, model.D, model.K))
    omega, zeta, phi = _damped_modes(M, D, K) if len(K) else (np.zeros(0), np.zeros(0), np.zeros((0, 0)))
    shapes = np.zeros((model.M.shape[0], omega.size))
    shapes[first:] = phi
    return ArmModes(omega, zeta, shapes, model.outputs)


def _damped_modes(M: Array, D: Array, K: Array) -> tuple[Array, Array, Array]:
    """Return magnitudes [rad/s] and damping ratios of the poles that oscillate, (r,), and shapes, (n, r)."""
    squares, phi = eigh(K, M)
    n, slowest = len(K), max(2 * np.pi * RIGID_HZ, ROUNDING * float(np.sqrt(abs(squares).max())))
    A = np.zeros((2 * n, 2 * n))
    A[:n, n:], A[n:, :n], A[n:, n:] = np.eye(n), -np.diag(squares), -phi.T @ D @ phi
    poles, vectors = np.linalg.eig(A)
    kept = np.flatnonzero(poles.imag > slowest)
    kept = kept[np.argsort(abs(poles[kept]), kind="stable")]
    poles, psi = poles[kept], vectors[:n, kept]
    psi = psi * np.exp(-0.5j * np.angle(np.sum(psi**2, axis=0)))
    shapes = phi @ (psi.real / np.linalg.norm(psi.real, axis=0))
    omega = np.abs(poles)
    return omega, -poles.real / omega, shapes
