"""How far off the way is that the markers draw for the tip of an arm with closed loops."""

from __future__ import annotations

import numpy as np
import pytest

from flexarm_bringup.display.shape import coordinates
from flexarm_bringup.model_view.mechanism_lines import MechanismLines
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree


@pytest.mark.parametrize(
    ("name", "direction"), [("planar_3rrr", [1.0, -0.5, 0.7]), ("spatial_3tpt", [0.5, -0.25, 0.35])]
)
def test_a_way_of_a_closed_loop_is_drawn_to_first_order(name: str, direction: list[float]) -> None:
    """Half as far from the pose of the model it is four times as near; docs/monitoring.md has the numbers."""
    tree = ReducedTree(load_config(find_manipulator(name)), use_compiler=False)
    lines, model = MechanismLines(tree), linearize(tree)
    at_rest, home = np.zeros(model.n_eta), lines.tip(model.q0)[:3, 3]
    off = []
    for step in (0.1, 0.05):  # rad or m
        theta = model.pose + step * np.array(direction)
        drawn = lines.tip(coordinates(model, theta, at_rest))[:3, 3]
        there = lines.tip(linearize(tree, theta).q0)[:3, 3]
        off.append(float(np.linalg.norm(drawn - there)))
        print(f"{name}: {1e3 * np.linalg.norm(there - home):5.1f} mm away {1e3 * off[-1]:5.2f} mm off")
    assert off[0] / off[1] == pytest.approx(4.0, rel=0.1)  # the next order is of a tenth of the step
