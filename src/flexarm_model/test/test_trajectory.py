"""A trajectory owns its samples, whatever they were made of."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from flexarm_model.motion.trajectory import Trajectory

T, THETA = [0.0, 1.0, 3.0], [[0.0], [0.5], [0.2]]


def test_arrays_of_the_caller_stay_his_and_the_trajectory_keeps_its_own() -> None:
    t, columns = np.array(T), np.array(THETA) * np.ones(3)
    made = Trajectory(t, columns[:, :1], columns[:, 1:2], columns[:, 2:])
    through = Trajectory.through(t, columns[:, :1])
    expected = [motion.sample(np.array([0.4, 2.0])) for motion in (made, through)]
    t += 5.0
    columns[:] = 7.0
    for motion, before in zip((made, through), expected, strict=True):
        assert motion.t.tolist() == T and motion.theta.tolist() == THETA
        np.testing.assert_array_equal(motion.sample(np.array([0.4, 2.0])), before)


def test_a_motion_goes_through_points_in_lists_as_through_points_in_arrays() -> None:
    times = np.linspace(-0.5, 3.5, 9)
    for theta_dot in (None, [[0.0], [0.1], [0.0]]):
        lists = Trajectory.through(T, THETA, theta_dot)
        rates = None if theta_dot is None else np.array(theta_dot)
        arrays = Trajectory.through(np.array(T), np.array(THETA), rates)
        np.testing.assert_array_equal(lists.sample(times), arrays.sample(times))


def test_samples_in_lists_of_whole_numbers_are_as_good_as_arrays() -> None:
    motion = Trajectory([0, 1], [[0], [2]], [[0], [0]], [[0], [0]], [[0], [0]])  # type: ignore[arg-type]
    arrays = [getattr(motion, name) for name in vars(motion)]
    assert all(array.dtype == float and not array.flags.writeable for array in arrays)
    np.testing.assert_allclose(motion.sample(np.array([0.5]))[0], [[1.0]], rtol=1e-12)


COLUMN = [[0.0], [0.0]]
MALFORMED: list[tuple[Sequence[object], str]] = [
    ((COLUMN, COLUMN, COLUMN, COLUMN), r"t has shape \(2, 1\); expected \(k,\)"),
    ((0.0, COLUMN, COLUMN, COLUMN), r"t has shape \(\); expected \(k,\)"),
    (([0, 1], [0, 1], [0, 0], [0, 0]), r"theta has shape \(2,\); expected \(2, n_theta\)"),
    (([0, 1], [[0, 1]], COLUMN, COLUMN), r"theta has shape \(1, 2\); expected \(2, 2\)"),
    (([0, 1], COLUMN, [0, 0], COLUMN), r"theta_dot has shape \(2,\); expected \(2, 1\)"),
    (([0, 1], COLUMN, COLUMN, COLUMN, [0, 0]), r"theta_ddot_before has shape \(2,\); expected \(2, 1\)"),
    (([0, 1], [[0], [0, 1]], COLUMN, COLUMN), r"theta is no array of numbers; expected \(k, n_theta\)"),
    ((["a", "b"], COLUMN, COLUMN, COLUMN), r"t is no array of numbers; expected \(k,\)"),
    (([0, 1], COLUMN, COLUMN, [[None], [0]]), "a value is not finite"),
]


@pytest.mark.parametrize(("parts", "message"), MALFORMED)
def test_what_is_no_trajectory_is_refused_with_the_shape_that_is_expected(
    parts: Sequence[np.ndarray], message: str
) -> None:
    with pytest.raises(ValueError, match=f"^reference: {message}$"):
        Trajectory(*parts)


def test_points_without_a_row_for_each_are_refused_in_the_same_words() -> None:
    with pytest.raises(ValueError, match=r"theta has shape \(3,\); expected \(3, n_theta\)"):
        Trajectory.through([0, 1, 2], [0, 1, 0])
