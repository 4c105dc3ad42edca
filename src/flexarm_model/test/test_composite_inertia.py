"""The mass matrix from composite inertias is the derivative of the inverse dynamics, whatever the arm."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from machines import MACHINES, machine_tree

from flexarm_model.tree.composite_inertia import composite_mass
from flexarm_model.tree.inertia import mass_matrix

SLOW = ("serial_6r",)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if name in SLOW else ()) for name in MACHINES]
)
def test_composite_inertias_give_the_derivative_of_the_inverse_dynamics(name: str) -> None:
    tree = machine_tree(name)
    q, a = tree._q, tree._a
    composite = composite_mass(tree._graph, tree.bodies, tree._at, tree._motions, (q, a))
    both = ca.Function("both", [q], [composite, mass_matrix(tree._inertia, a, tree._graph)])
    rng = np.random.default_rng(5)
    for _ in range(3):
        found, expected = (np.array(M) for M in both(tree.loops.home + 0.05 * rng.standard_normal(tree.n_q)))
        np.testing.assert_array_equal(found, found.T)
        scale = np.sqrt(np.diag(expected))  # small parts far from the origin lose four digits
        assert (abs(found - expected) <= 1e-11 * np.outer(scale, scale)).all()
