"""Every analytic Jacobian of the reduced tree against one finite-difference checker."""

from __future__ import annotations

import numpy as np
import pytest
from arms import random_states, scales, tree
from finite_difference import assert_jacobian, finite_difference

from flexarm_model.numeric.rotation import rotation_vector

CASES = [(name, seed) for name in ("spatial_rigid", "single_link", "planar", "spatial") for seed in range(3)]


@pytest.mark.parametrize(("name", "seed"), CASES)
def test_tip_jacobian_is_the_derivative_of_the_tip_pose(name: str, seed: int) -> None:
    arm_tree, scale = tree(name), scales(tree(name))
    q = random_states(arm_tree, 1, seed)[0, 0]
    R, J = arm_tree.tip_pose(q)[:3, :3], arm_tree.tip_jacobian(q)
    assert_jacobian(lambda x: arm_tree.tip_pose(x)[:3, 3], q, J[:3], scale)
    assert_jacobian(lambda x: rotation_vector(arm_tree.tip_pose(x)[:3, :3] @ R.T), q, J[3:], scale)


@pytest.mark.parametrize(("name", "seed"), CASES)
def test_linearisation_is_the_derivative_of_the_inverse_dynamics(name: str, seed: int) -> None:
    functions, scale = tree(name).functions, scales(tree(name))
    forces = functions["inverse_dynamics"]
    q = random_states(tree(name), 1, seed)[0, 0]
    rest = np.zeros(tree(name).n_q)
    M, D, K, f0 = tree(name).linearisation(q)
    assert f0 == pytest.approx(np.array(forces(q, rest, rest)), rel=1e-12)
    assert_jacobian(lambda x: forces(q, rest, x), rest, M, scale)
    assert_jacobian(lambda x: forces(x, rest, rest), q, K, scale)
    numeric = finite_difference(lambda x: forces(q, x, rest), rest, scale)
    assert pytest.approx(numeric, abs=1e-8 * np.linalg.norm(K)) == D


@pytest.mark.parametrize(("name", "seed"), CASES)
def test_output_rows_are_the_derivatives_of_the_outputs(name: str, seed: int) -> None:
    functions, scale = tree(name).functions, scales(tree(name))
    outputs = functions["outputs"]
    q = random_states(tree(name), 1, seed)[0, 0]
    rest = np.zeros(tree(name).n_q)
    y0, C_pos, C_vel, C_acc = (np.array(part) for part in functions["output_rows"](q))
    assert y0 == pytest.approx(np.array(outputs(q, rest, rest, q)), rel=1e-12, abs=1e-15)
    assert_jacobian(lambda x: outputs(x, rest, rest, q), q, C_pos, scale)
    assert_jacobian(lambda x: outputs(q, rest, x, q), rest, C_acc, scale)
    numeric = finite_difference(lambda x: outputs(q, x, rest, q), rest, scale)
    assert C_vel == pytest.approx(numeric, abs=1e-9 * np.linalg.norm(C_pos))
