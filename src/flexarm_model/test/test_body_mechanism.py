"""Trees of bodies as mechanisms: Jacobians of held and resting arms, and inverses that carry the sag."""

from __future__ import annotations

import numpy as np
import pytest
from arms import arm, tree
from finite_difference import assert_jacobian

from flexarm_model.kinematics.body_mechanism import held_mechanism, resting_mechanism
from flexarm_model.kinematics.numeric import InverseSettings, Mechanism, solve_inverse
from flexarm_model.numeric.rotation import rotation_vector

ARMS = ("spatial", "planar", "four_bar", "five_bar")


def check_jacobian(mechanism: Mechanism, theta: np.ndarray, scale: float) -> None:
    R, J = mechanism.pose(theta)[:3, :3], mechanism.jacobian(theta)
    assert_jacobian(lambda x: mechanism.pose(x)[:3, 3], theta, J[:3], scale)
    assert_jacobian(lambda x: rotation_vector(mechanism.pose(x)[:3, :3] @ R.T), theta, J[3:], scale)


@pytest.mark.parametrize("name", ARMS)
def test_held_mechanism_has_the_jacobian_of_its_pose(name: str) -> None:
    check_jacobian(held_mechanism(tree(name)), arm(name).home + 0.1, scale=0.3)


@pytest.mark.parametrize("name", ARMS)
def test_resting_mechanism_has_the_jacobian_of_its_pose(name: str) -> None:
    """Loops at rest are closed to 1e-10, so that the step of the difference must not be small."""
    check_jacobian(resting_mechanism(tree(name)), arm(name).home + 0.1, scale=3.0)


def test_inverse_of_the_resting_arm_makes_up_for_its_sag() -> None:
    held, resting = held_mechanism(tree("spatial")), resting_mechanism(tree("spatial"))
    theta = arm("spatial").home + 0.1
    target = held.pose(theta)  # where the arm would be if nothing bent
    sag = np.linalg.norm(resting.pose(theta)[:3, 3] - target[:3, 3])
    settings = InverseSettings(distance=1e-8, full_pose=False)
    found = solve_inverse(resting, target, theta, settings)
    assert sag > 1e-5
    np.testing.assert_allclose(resting.pose(found.theta)[:3, 3], target[:3, 3], atol=1e-8)
    assert abs(found.theta - theta).max() > 0.0


def test_limits_are_those_of_the_description() -> None:
    mechanism = held_mechanism(tree("single_link"))
    np.testing.assert_allclose(np.degrees([*mechanism.lower, *mechanism.upper]), [-170.0, 170.0])
