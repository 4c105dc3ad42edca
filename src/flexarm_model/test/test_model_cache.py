"""A pose that was served before costs nothing, and gives what it gave."""

from __future__ import annotations

import numpy as np
import pytest
from arms import tree

from flexarm_model.served.linearize import PoseError, linearize
from flexarm_model.served.model_cache import ModelCache


def test_a_pose_asked_for_again_gives_the_same_object() -> None:
    cache = ModelCache(tree("planar"))
    first = cache.at(np.array([0.1, 0.2]))
    assert cache.at(np.array([0.1, 0.2])) is first
    assert first.model_id == linearize(tree("planar"), np.array([0.1, 0.2])).model_id
    assert cache.at() is cache.at(tree("planar").config.home) and len(cache) == 2


def test_the_smallest_difference_is_another_pose_but_minus_zero_is_none() -> None:
    cache = ModelCache(tree("single_link"))
    assert cache.at(np.array([-0.0])) is cache.at(np.array([0.0]))
    assert cache.at(np.array([5e-324])) is not cache.at(np.array([0.0]))


def test_the_model_not_used_for_longest_goes_first() -> None:
    cache = ModelCache(tree("single_link"), capacity=2)
    a, b = cache.at(np.array([0.1])), cache.at(np.array([0.2]))
    assert cache.at(np.array([0.1])) is a  # now b is the older one
    cache.at(np.array([0.3]))
    assert cache.at(np.array([0.1])) is a and len(cache) == 2
    assert cache.at(np.array([0.2])) is not b


def test_what_has_no_model_is_refused_and_not_kept() -> None:
    cache = ModelCache(tree("single_link"))
    for pose in ([9.0], [np.nan], [0.0, 0.0]):
        for _ in range(2):
            with pytest.raises(PoseError):
                cache.at(np.array(pose))
    assert len(cache) == 0
    with pytest.raises(ValueError, match="capacity 0"):
        ModelCache(tree("single_link"), 0)
