"""What is no torque of every axis is refused, and the rig stays as it was."""

from __future__ import annotations

import numpy as np
import pytest

from flexarm_bringup.sim.rig import Rig, RigSettings
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator


@pytest.fixture(scope="module")
def rig() -> Rig:
    """A rig of one axis."""
    return Rig(load_config(find_manipulator("single_link")), RigSettings(noise=0.0))


@pytest.mark.parametrize(
    "tau", [[np.nan], [np.inf], [-np.inf], [None], np.zeros(2), [], 0.0, np.zeros((1, 1)), None]
)
def test_what_is_no_torque_of_every_axis_is_refused_before_anything_moves(rig: Rig, tau: object) -> None:
    tick, q = rig.tick, rig.plant.q.copy()
    with pytest.raises(ValueError, match=r"^tau is .*; expected .* one finite number per axis: base\.rz$"):
        rig.step(tau)  # type: ignore[arg-type]
    assert rig.tick == tick
    np.testing.assert_array_equal(rig.plant.q, q)


def test_torques_in_a_list_move_the_rig_as_those_in_an_array(rig: Rig) -> None:
    moved = []
    for tau in ([1], [1.0], np.ones(1), np.ones(1, np.float32)):
        rig.plant.reset()
        rig.step(tau)  # type: ignore[arg-type]
        moved.append(rig.plant.q.tolist())
    assert moved[0] != [0.0] * len(moved[0]) and moved.count(moved[0]) == len(moved)
