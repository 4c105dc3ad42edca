"""A trajectory owns its samples, whatever they were made of."""

from __future__ import annotations

import numpy as np

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
