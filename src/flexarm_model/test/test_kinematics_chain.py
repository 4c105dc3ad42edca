"""Chains, two links and branches: against elementary rotations, complex numbers and finite differences."""

from __future__ import annotations

import math

import numpy as np
import pytest
from finite_difference import assert_jacobian
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from flexarm_model.kinematics.branches import nearest, wrap
from flexarm_model.kinematics.dh import DhChain, DhRow, ModifiedDhRow
from flexarm_model.kinematics.refusals import LimitError, ReachError, SingularPoseError
from flexarm_model.kinematics.two_links import end_jacobian, place_end, reach_end
from flexarm_model.numeric.rotation import rotation_vector

ANGLE = st.floats(-math.pi, math.pi)
LENGTH = st.floats(0.05, 2.0)
BENT = st.floats(0.02, math.pi - 0.02).flatmap(lambda a: st.sampled_from([a, -a]))
EXAMPLES = settings(max_examples=60, deadline=None, derandomize=True)
CHAIN = DhChain(
    (DhRow(0.3, 0.1, 0.7), DhRow(-0.2, 0.4, -1.2, 0.5), DhRow(0.1, 0.0, 2.0), DhRow(0.0, 0.3, 0.0))
)


def elementary(axis: str, angle: float = 0.0, shift: float = 0.0) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler(axis, angle).as_matrix()
    T["xyz".index(axis), 3] = shift
    return T


@EXAMPLES
@given(ANGLE, LENGTH, LENGTH, ANGLE, ANGLE)
def test_a_row_is_two_screws_one_after_the_other(
    q: float, d: float, a: float, alpha: float, o: float
) -> None:
    expected = elementary("z", q + o, d) @ elementary("x", alpha, a)
    np.testing.assert_allclose(DhRow(d, a, alpha, o).step(q), expected, atol=1e-14)


@EXAMPLES
@given(ANGLE, LENGTH, LENGTH, ANGLE, ANGLE)
def test_a_modified_row_is_the_same_screws_in_the_other_order(
    q: float, d: float, a: float, alpha: float, o: float
) -> None:
    expected = elementary("x", alpha, a) @ elementary("z", q + o, d)
    np.testing.assert_allclose(ModifiedDhRow(d, a, alpha, o).step(q), expected, atol=1e-14)


MODIFIED = DhChain(tuple(ModifiedDhRow(row.d, row.a, row.alpha, row.offset) for row in CHAIN.rows))


@pytest.mark.parametrize("chain", [CHAIN, MODIFIED], ids=["standard", "modified"])
@pytest.mark.parametrize("seed", range(5))
def test_the_chain_jacobian_is_the_derivative_of_its_pose(seed: int, chain: DhChain) -> None:
    q = np.random.default_rng(seed).uniform(-3.0, 3.0, 4)
    R, J = chain.pose(q)[:3, :3], chain.jacobian(q)
    assert_jacobian(lambda x: chain.pose(x)[:3, 3], q, J[:3])
    assert_jacobian(lambda x: rotation_vector(chain.pose(x)[:3, :3] @ R.T), q, J[3:])


@EXAMPLES
@given(LENGTH, LENGTH, ANGLE, BENT)
def test_two_links_reach_where_they_were_placed(a: float, b: float, angle: float, turn: float) -> None:
    end = place_end(a, b, angle, turn)
    if np.linalg.norm(end) < 1e-3:  # equal links folded: the angle is hardly defined
        return
    found = reach_end(end, a, b, 1 if turn > 0.0 else -1)
    rounding = 1e-14 * (a + b) ** 2 / (min(a, b) * np.linalg.norm(end) * abs(math.sin(turn)))
    np.testing.assert_allclose(wrap(np.subtract(found, (angle, turn))), 0.0, atol=1e-13 + 10.0 * rounding)
    other = reach_end(end, a, b, -1 if turn > 0.0 else 1)
    np.testing.assert_allclose(place_end(a, b, *other), end, atol=1e-13)


@EXAMPLES
@given(LENGTH, LENGTH, ANGLE, BENT)
def test_two_links_have_the_jacobian_of_their_end(a: float, b: float, angle: float, turn: float) -> None:
    at = np.array([angle, turn])
    assert_jacobian(lambda x: place_end(a, b, x[0], x[1]), at, end_jacobian(a, b, angle, turn))


def test_stretched_and_folded_links_are_still_reached() -> None:
    assert reach_end(np.array([0.0, 0.7]), 0.4, 0.3, 1) == pytest.approx((math.pi / 2, 0.0), abs=1e-7)
    angle, turn = reach_end(np.array([0.1, 0.0]), 0.4, 0.3, -1)
    assert (angle, abs(turn)) == (pytest.approx(0.0, abs=1e-7), pytest.approx(math.pi, abs=1e-7))


def test_an_end_out_of_reach_is_refused_with_the_distances() -> None:
    with pytest.raises(ReachError, match=r"distance 0\.8 m, the links reach 0\.1 \.\.\. 0\.7 m") as caught:
        reach_end(np.array([0.0, 0.8]), 0.4, 0.3, 1)
    assert caught.value.distance - caught.value.farthest == pytest.approx(0.1)
    with pytest.raises(ReachError, match=r"distance 0\.05 m"):
        reach_end(np.array([0.05, 0.0]), 0.4, 0.3, 1)
    with pytest.raises(SingularPoseError, match="angle is free"):
        reach_end(np.zeros(2), 0.3, 0.3, 1)


@pytest.mark.parametrize(
    ("distance", "said"),
    [
        (0.5300001, "distance 0.5300001 m, the links reach 0.05 ... 0.53 m"),
        (0.04999999, "distance 0.04999999 m, the links reach 0.05 ... 0.53 m"),
        (0.53 * (1.0 + 1e-11), "distance 0.53000000001 m, the links reach 0.05 ... 0.53 m"),
    ],
)
def test_an_end_barely_out_of_reach_is_told_from_the_reach(distance: float, said: str) -> None:
    """It read "distance 0.53 m, the links reach 0.05 ... 0.53 m"."""
    with pytest.raises(ReachError) as caught:
        reach_end(np.array([distance, 0.0]), 0.29, 0.24, 1)
    assert said in str(caught.value)


def test_the_nearest_branch_counts_full_turns() -> None:
    solutions = np.array([[0.1, 3.1], [1.0, -1.0]])
    np.testing.assert_allclose(nearest(solutions, np.array([6.2, -3.2])), [0.1 + 2 * np.pi, 3.1 - 2 * np.pi])
    np.testing.assert_allclose(nearest(solutions, np.array([0.8, -0.5])), [1.0, -1.0])


def test_the_nearest_branch_stays_within_limits_or_is_refused() -> None:
    solutions = np.array([[3.1], [1.0]])
    low, high = np.array([-np.pi]), np.array([2.0])
    np.testing.assert_allclose(nearest(solutions, np.array([2.9]), low, high), [1.0])
    np.testing.assert_allclose(
        nearest(solutions, np.array([-3.1]), np.array([-4.0]), high), [3.1 - 2 * np.pi]
    )
    np.testing.assert_allclose(nearest(np.array([[0.1]]), np.array([6.2]), low, np.array([6.3])), [0.1])
    with pytest.raises(LimitError, match="none of 2 solutions"):
        nearest(solutions, np.array([0.0]), np.array([-0.5]), np.array([0.5]))
