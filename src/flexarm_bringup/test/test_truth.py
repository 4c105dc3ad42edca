"""What really happens on the rig: also what a rigid arm moving the same axes would feel."""

from __future__ import annotations

import numpy as np
import pytest

from flexarm_bringup.sim.rig import Rig, RigSettings
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator


def test_a_rigid_arm_feels_the_acceleration_and_the_speed_of_its_axis() -> None:
    config = load_config(find_manipulator("single_link"))
    rig, a = Rig(config, RigSettings(noise=0.0)), 3.0
    for _ in range(100):
        rig.servo(np.array([a]))
    truth = rig.truth()
    (felt,) = truth.rigid_acceleration  # across the strip
    assert truth.theta_dot == pytest.approx([a * 100 * rig.dt], rel=1e-6)
    assert felt / a == pytest.approx(0.63, abs=0.02)  # m, of the sensor from the axis
    assert abs(truth.acceleration[0] - felt) > 1e-3  # the strip rings
