"""The arm with more modes than are served, in the modes that it has with its axes free, period by period.

From ``M xi'' + D xi' + K xi = B tau`` with every elastic mode, frequencies of the locked modes times
``s = 1 + frequency_error`` at their shapes and damping ratios, and ``K phi = M phi omega^2``::

    xi = Phi r      r'' + Phi' D Phi r' + Omega^2 r = f      f = Phi' B tau      y = C [r; r'] + E f

``f_j`` is the force on mode j: one number for all torques together. The slowest ``n_theta`` coordinates are
the motions of the axes, the others are numbered "mode_1", "mode_2", ... as the served ones are: no locked
mode is faster than the free one of its number (Rayleigh's theorem on constraints).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh, expm

from flexarm_model.served.linearize import linearize
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
PARTS = 8  # of a period, over which a force may be late
SLOWEST = 1.0  # rad/s; positions are scaled by the frequency of their mode, but not by less


@dataclass(frozen=True)
class FullPlant:
    """Discrete plant; the state is ``[w r; r']``, w a scale per mode.

    Attributes:
        names: Of the modes, "axes" and "mode_1" on, (n,).
        omega: Frequencies with the axes free [rad/s], zero of those that nothing holds, (n,).
        A: (2 n, 2 n).
        force: Change of state by a unit force on every mode, held over the period, (2 n, n).
        early: What of it is due to the first k of ``PARTS`` parts of the period, (PARTS + 1, 2 n, n).
        C: Of the sensors, (n_y, 2 n).
        E: Their feed-through of the forces, (n_y, n).
        b: Forces on the modes per torque, (n, n_u).
    """

    names: tuple[str, ...]
    omega: Array
    A: Array
    force: Array
    early: Array
    C: Array
    E: Array
    b: Array


def full_model(tree: ReducedTree, pose: Array, f_max: float) -> ReducedModel:
    """Return the model of a tree at a pose with all of its modes up to ``f_max`` [Hz].

    Raises:
        PoseError: There is no model at this pose.
    """
    everything = linearize(tree, pose, tree.n_q - tree.n_c - len(tree.actuated))
    kept = int((everything.omega <= 2.0 * np.pi * f_max).sum())
    return _first_modes(everything, kept)


def build_plant(model: ReducedModel, rows: tuple[str, ...], dt: float, frequency_error: float) -> FullPlant:
    """Discretise a model with all its modes.

    Args:
        model: From ``full_model``.
        rows: Output rows "sensor.channel" that the filter fuses.
        dt: Control period [s].
        frequency_error: Real over described frequency of all locked modes, minus one [1].

    Raises:
        ValueError: The model lacks a row.
    """
    D, K = _detuned(model, 1.0 + frequency_error)
    squares, Phi = eigh(K, model.M)
    omega = np.sqrt(np.maximum(squares, 0.0))
    n, width = model.n, np.maximum(omega, SLOWEST)
    damping = Phi.T @ D @ Phi
    A = np.zeros((2 * n, 2 * n))
    A[:n, n:], A[n:, :n], A[n:, n:] = np.diag(width), np.diag(-squares / width), -damping
    known = model.outputs.names
    index = [known.index(row) for row in rows]
    C_pos, C_vel, C_acc = (
        part[index] @ Phi for part in (model.outputs.C_pos, model.outputs.C_vel, model.outputs.C_acc)
    )
    C = np.hstack([C_pos / width, C_vel]) + C_acc @ A[n:]
    A_d, early = _held(A, np.vstack([np.zeros((n, n)), np.eye(n)]), dt)
    names = ("axes",) * model.n_theta + tuple(f"mode_{k + 1}" for k in range(model.n_eta))
    return FullPlant(names, omega, A_d, early[-1], early, C, C_acc, Phi.T @ model.B)


def _detuned(model: ReducedModel, scale: float) -> tuple[Array, Array]:
    """Return damping and stiffness with the locked modes' frequencies times ``scale``, ratios kept."""
    elastic = slice(model.n_theta, model.n)
    D, K = model.D.copy(), model.K.copy()
    D[elastic, elastic] *= scale
    K[elastic, elastic] *= scale**2
    return D, K


def _held(A: Array, B: Array, dt: float) -> tuple[Array, Array]:
    """Return exp(A dt), and of the held input's effect what the first parts of the period cause."""
    n, m = B.shape
    step = np.zeros((n + m, n + m))
    step[:n, :n], step[:n, n:] = A, B
    part = expm(step * (dt / PARTS))
    E, Gamma = part[:n, :n], part[:n, n:]
    powers = [np.eye(n)]
    for _ in range(PARTS):
        powers.append(powers[-1] @ E)
    early = [np.zeros((n, m))]
    for k in range(PARTS):  # what part k causes has PARTS - 1 - k parts left to move on
        early.append(early[-1] + powers[PARTS - 1 - k] @ Gamma)
    return powers[-1], np.array(early)


def _first_modes(model: ReducedModel, n_eta: int) -> ReducedModel:
    n, out = model.n_theta + n_eta, model.outputs
    outputs = replace(out, C_pos=out.C_pos[:, :n], C_vel=out.C_vel[:, :n], C_acc=out.C_acc[:, :n])
    return replace(
        model, M=model.M[:n, :n], D=model.D[:n, :n], K=model.K[:n, :n], B=model.B[:n], f0=model.f0[:n],
        omega=model.omega[:n_eta], zeta=model.zeta[:n_eta], outputs=outputs, Phi=model.Phi[:, :n],
    )  # fmt: skip
