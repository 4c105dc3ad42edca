"""Poses kept back from a fit tell whether it holds elsewhere."""

from __future__ import annotations

import numpy as np
import pytest

from flexarm_model.identification.mode_table import ModeTable
from flexarm_model.identification.pose_split import check_poses, split_poses


def table(pose: float, f_hz: float) -> ModeTable:
    nothing = np.full(1, np.nan)
    return ModeTable(np.array([pose]), np.array([f_hz]), nothing, nothing, nothing)


def serve(changes, pose):
    return np.array([float(changes.get("k", 1.0)) * (10.0 + pose[0]), 99.0]), np.zeros(2)


@pytest.mark.parametrize(("poses", "kept"), [(1, 0), (2, 1), (3, 1), (4, 2), (6, 2)])
def test_a_third_of_the_poses_is_kept_back_and_one_alone_is_not(poses: int, kept: int) -> None:
    tables = [table(float(i), 1.0) for i in range(poses)]
    told, back = split_poses(tables)
    assert len(back) == kept and [*told, *back] == tables


def test_a_fit_that_holds_elsewhere_is_told_from_one_that_does_not() -> None:
    right, wrong = (check_poses(serve, {"k": k}, [table(0.0, 11.0), table(1.0, 12.1)]) for k in (1.1, 0.5))
    assert right is not None and wrong is not None
    assert right.before == pytest.approx(0.1 / 1.1) and right.after == pytest.approx(0.0, abs=1e-12)
    assert right.holds and not wrong.holds and right.poses == 2
    assert check_poses(serve, {}, []) is None


def test_fitted_values_without_a_model_at_a_pose_kept_back_are_named() -> None:
    def buckles(changes, pose):
        if changes:
            raise ValueError("pose [0.0]: no stable equilibrium")
        return serve(changes, pose)

    with pytest.raises(
        ValueError, match=r"^the fitted values .* kept back: k = 0.5: pose \[0.0\]: no stable"
    ):
        check_poses(buckles, {"k": 0.5}, [table(0.0, 11.0)])
