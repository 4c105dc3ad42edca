"""Numeric inverse kinematics against closed forms, at limits and out of reach."""

from __future__ import annotations

import math

import numpy as np
import pytest
from arms import random_states, tree
from scipy.optimize import least_squares

from flexarm_model.kinematics.branches import wrap
from flexarm_model.kinematics.elbow_arm import ElbowArm
from flexarm_model.kinematics.numeric import InverseSettings, Mechanism, solve_inverse
from flexarm_model.kinematics.refusals import ConvergenceError
from flexarm_model.kinematics.spherical_wrist import SphericalWristArm

SIX = SphericalWristArm(0.50, 0.18, 0.80, 0.15, 0.85, 0.14)
ELBOW = ElbowArm(0.040, 0.290, 0.240)
TARGET = SIX.chain.pose(np.array([0.2, 0.3, 0.1, 0.3, 0.4, 0.0]))
START = np.array([0.0, 0.0, 0.0, 0.0, 0.5, 0.0])
FULL = InverseSettings()
POINT = InverseSettings(full_pose=False)


def six(limit: float = math.inf) -> Mechanism:
    return Mechanism(SIX.chain.pose, SIX.chain.jacobian, np.full(6, -limit), np.full(6, limit))


def elbow() -> Mechanism:
    free = np.full(3, np.inf)
    return Mechanism(ELBOW.chain.pose, ELBOW.chain.jacobian, -free, free)


@pytest.mark.parametrize("seed", range(20))
def test_full_pose_of_six_axes_is_one_of_the_closed_solutions(seed: int) -> None:
    rng = np.random.default_rng(seed)
    q = rng.uniform(-1.0, 1.0, 6) + [0.0, 0.3, 0.0, 0.0, 1.3, 0.0]
    target = SIX.chain.pose(q)
    found = solve_inverse(six(), target, q + rng.uniform(-0.2, 0.2, 6))
    assert found.distance <= FULL.distance
    assert found.angle <= FULL.angle
    assert abs(wrap(SIX.solutions(target) - found.theta)).max(axis=1).min() < 1e-6  # tolerance over sines
    np.testing.assert_allclose(SIX.chain.pose(found.theta), target, atol=2e-9)


@pytest.mark.parametrize("seed", range(20))
def test_position_alone_of_three_axes_is_one_of_the_closed_solutions(seed: int) -> None:
    rng = np.random.default_rng(seed)
    q = np.array([rng.uniform(-3, 3), rng.uniform(-0.5, 1.5), rng.uniform(-2.0, -0.3)])
    target = ELBOW.chain.pose(q)
    found = solve_inverse(elbow(), target, q + rng.uniform(-0.3, 0.3, 3), POINT)
    assert abs(wrap(ELBOW.solutions(target[:3, 3]) - found.theta)).max(axis=1).min() < 1e-7
    assert found.angle == 0.0


def test_an_arm_with_axes_to_spare_goes_round_a_limit() -> None:
    free = solve_inverse(six(), TARGET, START, POINT)
    upper = np.full(6, np.inf)
    upper[1] = free.theta[1] - 0.02
    target, mechanism = TARGET, Mechanism(SIX.chain.pose, SIX.chain.jacobian, -upper, upper)
    found = solve_inverse(mechanism, target, START, POINT)
    np.testing.assert_allclose(SIX.chain.pose(found.theta)[:3, 3], target[:3, 3], atol=1e-9)
    assert found.theta[1] <= upper[1]


def test_beyond_a_limit_it_stays_as_far_away_as_bounded_least_squares_do() -> None:
    upper = np.full(6, np.inf)
    upper[1] = 0.25
    mechanism = Mechanism(SIX.chain.pose, SIX.chain.jacobian, -upper, upper)
    with pytest.raises(ConvergenceError, match="stuck at a limit or out of reach") as caught:
        solve_inverse(mechanism, TARGET, START, POINT)
    other = least_squares(lambda q: SIX.chain.pose(q)[:3, 3] - TARGET[:3, 3], START, bounds=(-upper, upper))
    assert caught.value.distance == pytest.approx(np.linalg.norm(other.fun), rel=1e-3)  # its tolerance


def test_convergence_is_that_of_newton() -> None:
    q = np.array([0.2, 0.4, 0.3, 0.5, 0.8, 0.1])
    assert solve_inverse(six(), SIX.chain.pose(q), q + 0.1).iterations <= 8


def test_out_of_reach_says_how_far_away_it_stays() -> None:
    target = np.eye(4)
    target[:3, 3] = [0.63, 0.0, 0.040]  # 0.1 m farther than both links
    with pytest.raises(ConvergenceError, match="0.1 m and 0 rad left after") as caught:
        solve_inverse(elbow(), target, np.array([0.2, 0.3, -0.5]), POINT)
    assert caught.value.distance == pytest.approx(0.1, abs=1e-6)
    assert 0 < caught.value.iterations < POINT.iterations


def test_limits_that_forbid_the_pose_say_so() -> None:
    target = SIX.chain.pose(np.full(6, 0.5))
    with pytest.raises(ConvergenceError, match="stuck at a limit or out of reach") as caught:
        solve_inverse(six(0.3), target, np.zeros(6))
    assert caught.value.distance > 0.01


def test_a_start_at_the_wrist_singularity_is_left() -> None:
    q = np.array([0.2, 0.4, 0.3, 0.5, 0.4, 0.1])
    found = solve_inverse(six(), SIX.chain.pose(q), np.zeros(6))
    np.testing.assert_allclose(SIX.chain.pose(found.theta), SIX.chain.pose(q), atol=2e-9)


def test_a_body_tree_is_a_mechanism_too() -> None:
    spatial = tree("spatial_rigid")
    q = random_states(spatial, 1, 3)[0, 0]
    free = np.full(spatial.n_q, np.inf)
    mechanism = Mechanism(spatial.tip_pose, spatial.tip_jacobian, -free, free)
    found = solve_inverse(mechanism, spatial.tip_pose(q), q + 0.05, POINT)
    np.testing.assert_allclose(spatial.tip_pose(found.theta)[:3, 3], spatial.tip_pose(q)[:3, 3], atol=1e-9)
