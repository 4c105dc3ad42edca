"""What is no point, no pose and no sign is refused by name, as documented."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from arms import arm

from flexarm_model.kinematics.elbow_arm import ElbowArm
from flexarm_model.kinematics.numeric import InverseSettings, Mechanism, solve_inverse
from flexarm_model.kinematics.planar_legs import PlanarLegs
from flexarm_model.kinematics.refusals import KinematicsError, ReachError
from flexarm_model.kinematics.spherical_wrist import SphericalWristArm
from flexarm_model.kinematics.telescopic_legs import TelescopicLegs
from flexarm_model.kinematics.two_links import reach_end
from flexarm_model.segments.segment_tree import SegmentTree

ELBOW = ElbowArm(0.3, 0.4, 0.5)
LEGS = PlanarLegs.regular((0.4, 0.12), (0.5, 2.6, 4.7), (0.336, 0.336), bend=-1)
LIFTS = TelescopicLegs.regular((0.4, 0.1), np.array([0.5, 2.6, 4.7]), np.eye(3))
WRIST = SphericalWristArm(0.4, 0.18, 0.6, 0.12, 0.62, 0.115)
POINT = np.array([0.4, 0.2, 0.5])
NO_POINT = np.array([0.4, np.nan, 0.5])
NO_POSE = np.array([[1.0, 0, 0, np.nan], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
REFUSED: list[tuple[Callable[[], object], str]] = [
    (lambda: ELBOW.solve(NO_POINT, 1), r"tip is \[.*nan.*\]; expected 3 finite numbers"),
    (lambda: ELBOW.solve(POINT[:2], 1), "tip is .*; expected 3 finite numbers"),
    (lambda: ELBOW.nearest(NO_POINT, np.zeros(3)), "tip is .*; expected 3 finite numbers"),
    (lambda: ELBOW.nearest(POINT, NO_POINT), "q is .*; expected 3 finite numbers"),
    (lambda: ELBOW.solve(POINT, 0), "elbow is 0; expected 1 or -1"),
    (lambda: ELBOW.solve(POINT, 2), "elbow is 2; expected 1 or -1"),
    (lambda: ELBOW.solve(POINT, 1, 3), "facing is 3; expected 1 or -1"),
    (lambda: reach_end(POINT[:2], 0.4, 0.3, 0), "bend is 0; expected 1 or -1"),
    (lambda: LEGS.angles(NO_POINT), "pose is .*; expected 3 finite numbers"),
    (lambda: LEGS.pose(NO_POINT, np.zeros(3)), "first is .*; expected 3 finite numbers"),
    (lambda: LEGS.pose(np.zeros(3), NO_POINT), "guess is .*; expected 3 finite numbers"),
    (lambda: LIFTS.position(np.ones(3), np.eye(3), 2), "side is 2; expected 1 or -1"),
    (lambda: WRIST.solutions(NO_POSE), "the pose is not finite"),
]


@pytest.mark.parametrize(("ask", "text"), REFUSED)
def test_what_cannot_be_meant_is_refused_by_name(ask: Callable[[], object], text: str) -> None:
    with pytest.raises(KinematicsError, match=text):
        ask()


def test_an_end_that_is_no_point_is_not_reached() -> None:
    with pytest.raises(ReachError, match="distance nan m"):
        reach_end(np.array([np.nan, 0.1]), 0.4, 0.3, 1)


def elbow_as_mechanism() -> Mechanism:
    def pose(q: np.ndarray) -> np.ndarray:
        T = np.eye(4)
        T[:3, 3] = ELBOW.position(q)
        return T

    def jacobian(q: np.ndarray) -> np.ndarray:
        return np.vstack([ELBOW.jacobian(q), np.zeros((3, 3))])

    return Mechanism(pose, jacobian, np.full(3, -3.0), np.full(3, 3.0))


@pytest.mark.parametrize("guess", [[np.nan, 0.1, 0.8], [0.1], [[0.1, 0.1, 0.8]]])
def test_a_guess_that_is_none_is_refused(guess: list[float]) -> None:
    with pytest.raises(KinematicsError, match="guess is .*; expected 3 finite numbers"):
        solve_inverse(elbow_as_mechanism(), np.eye(4), np.array(guess), InverseSettings(full_pose=False))


def test_a_target_in_lists_is_taken_as_one_in_arrays() -> None:
    elbow, settings = elbow_as_mechanism(), InverseSettings(full_pose=False)
    target, guess = elbow.pose(np.array([0.3, 0.2, 0.9])), np.array([0.1, 0.1, 0.8])
    listed = solve_inverse(elbow, target.tolist(), guess.tolist(), settings)  # type: ignore[arg-type]
    np.testing.assert_array_equal(listed.theta, solve_inverse(elbow, target, guess, settings).theta)


@pytest.mark.parametrize("count", [0, -1, 2.5, 2.0, "two", None])
def test_a_beam_of_no_whole_number_of_segments_is_refused(count: object) -> None:
    expected = f"^n_segments is {count}; expected a whole number of springs per beam, 1 or more$"
    with pytest.raises(ValueError, match=expected):
        SegmentTree(arm("single_link"), count)  # type: ignore[arg-type]
