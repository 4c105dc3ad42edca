"""Centripetal and Coriolis loads of the five arms, against differences of their inertia; nothing sags."""

from dataclasses import replace
from itertools import combinations_with_replacement

import numpy as np
import pytest

from flexarm_controller.guarding.turning_loads import turning_loads
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

STEP = 1e-4  # rad or m
FROM_HOME = 0.05  # rad or m; at home much is zero
POSES = {
    "single_link": [1.0],
    "variable_stiffness": [0.3, 0.9, 0.7],
    "serial_6r": [0.3, 0.2, -0.2, 0.4, -0.6, 0.5],
}
SLOW = [pytest.param(name, marks=pytest.mark.slow) for name in ("planar_3rrr", "spatial_3tpt", "serial_6r")]


def by_differences(tree, pose):
    """Return sum_jk (dM_ij / dq_k - dM_jk / dq_i / 2) v_j v_k as coefficients of v_j v_k, j <= k."""
    n = len(pose)

    def inertia(at):
        return linearize(tree, at).M[:n, :n]

    dM = [(inertia(pose + step) - inertia(pose - step)) / (2.0 * STEP) for step in STEP * np.eye(n)]
    full = np.einsum("kij->ijk", dM) - np.array(dM) / 2.0  # dM[i] holds dM_jk / dq_i
    pairs = combinations_with_replacement(range(n), 2)
    return np.column_stack([full[:, j, k] + (full[:, k, j] if j != k else 0.0) for j, k in pairs])


@pytest.mark.parametrize("name", ["single_link", "variable_stiffness", *SLOW])
def test_turning_loads_are_the_christoffel_terms_of_the_inertia(name):
    """Also where loops are closed; 1e-6 is what differences over 1e-4 rad leave."""
    config = load_config(find_manipulator(name))
    tree = ReducedTree(replace(config, gravity=np.zeros(3)))
    pose = np.array(POSES.get(name, tree.config.home + FROM_HOME * np.cos(np.arange(len(tree.actuated)))))
    wanted = by_differences(tree, pose)
    found = turning_loads(tree, linearize(tree, pose))
    np.testing.assert_allclose(found, wanted, atol=1e-6 * abs(wanted).max() + 1e-9)
    assert abs(wanted).max() > 1e-3 or name == "single_link"  # which turns about one axis that stays
