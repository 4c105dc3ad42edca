"""Equation of motion of an arm without loops in the coordinates of the nonlinear controller.

``y = [theta; e]``, actuated axes first, ``q = q_c + T y`` in the coordinates of the tree::

    force(y, y', y'') = T' inverse_dynamics(q, T y', T y'') = [tau; 0]

``e`` are all other coordinates of the tree where every mode is slow enough to be controlled; else the
slowest modes at home, and what they leave out keeps its static value.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from flexarm_model.numeric.compiled import FastFunction, compile_functions
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]


class NonlinearModelError(ValueError):
    """The nonlinear controller cannot be made for this arm or on this machine; the message says why."""


@dataclass(frozen=True)
class Coordinates:
    """``q = q_c + T y``, read-only.

    Attributes:
        T: (n_q, n).
        q_c: (n_q,).
    """

    T: Array
    q_c: Array

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        self.T.flags.writeable = self.q_c.flags.writeable = False


@dataclass(frozen=True)
class ArmEquations:
    """Forces of the arm and their derivatives, compiled.

    Attributes:
        force: (y, y', y'') -> force (n,), its derivatives by y, y' and y'', (n, n) each.
        n: Number of coordinates.
        n_u: Number of actuated axes.
    """

    force: FastFunction
    n: int
    n_u: int


def choose_coordinates(tree: ReducedTree, fastest: float) -> Coordinates:
    """Return the coordinates that hold all modes up to ``fastest`` [rad/s], at home with axes locked.

    Raises:
        NonlinearModelError: The arm has closed loops.
    """
    if tree.n_c:
        raise NonlinearModelError(f"{tree.config.name} has closed loops; law 'nmpc' is for open arms")
    n_theta = len(tree.actuated)
    everything = linearize(tree, modes=tree.n_q - n_theta)
    kept = int((everything.omega <= fastest).sum())
    if kept == tree.n_q - n_theta:
        others = np.setdiff1d(np.arange(tree.n_q), tree.actuated)
        return Coordinates(np.eye(tree.n_q)[:, [*tree.actuated, *others]], np.zeros(tree.n_q))
    T = everything.Phi[:, : n_theta + kept].copy()
    return Coordinates(T, everything.q0 - T[:, :n_theta] @ everything.pose)


def compile_arm(tree: ReducedTree, coordinates: Coordinates) -> ArmEquations:
    """Write and compile the equations of a tree."""
    T, q_c = ca.sparsify(ca.DM(coordinates.T)), ca.sparsify(ca.DM(coordinates.q_c))
    n = T.shape[1]
    y, w, a = (ca.SX.sym(name, n) for name in ("y", "w", "a"))
    force = T.T @ tree.expressions["inverse_dynamics"](q_c + T @ y, T @ w, T @ a)
    return compile_equations(ca.Function("force", [y, w, a], [force]), len(tree.actuated))


def compile_equations(force: ca.Function, n_u: int) -> ArmEquations:
    """Differentiate and compile ``(y, y', y'') -> force`` (SX), whose first ``n_u`` rows are driven."""
    n = force.numel_out(0)
    y, w, a = (ca.SX.sym(name, n) for name in ("y", "w", "a"))
    f = force(y, w, a)
    everything = ca.Function("forces", [y, w, a], [f, *(ca.jacobian(f, x) for x in (y, w, a))], {"cse": True})
    return ArmEquations(compile_functions({"forces": everything})["forces"], n, n_u)
