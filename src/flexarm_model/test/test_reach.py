"""How far the tip can be at most: against lengths of links, and tips all over the ranges."""

from __future__ import annotations

import numpy as np
import pytest
from arms import arm, tree

from flexarm_model.kinematics.body_mechanism import held_mechanism
from flexarm_model.kinematics.reach import reach_of


@pytest.mark.parametrize("name", ["single_link", "spatial", "planar", "five_bar"])
def test_no_axes_bring_the_tip_out_of_reach(name: str) -> None:
    mechanism, reach = held_mechanism(tree(name)), reach_of(tree(name))
    for step in np.random.default_rng(0).uniform(-0.1, 0.1, (20, arm(name).home.size)):
        assert reach.missing(mechanism.pose(arm(name).home + step)[:3, 3]) < 1e-9


def test_the_reach_of_one_link_is_its_length() -> None:
    reach = reach_of(tree("single_link"))
    tip = held_mechanism(tree("single_link")).pose(arm("single_link").home)[:3, 3]
    np.testing.assert_allclose(reach.center, 0.0, atol=1e-12)
    assert reach.radius == pytest.approx(np.linalg.norm(tip))
    assert reach.missing(2.0 * tip) == pytest.approx(reach.radius)
