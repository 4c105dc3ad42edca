"""A rig with a motor of the wrong sign: the guard's braking drives it on, until the guard gives up."""

from __future__ import annotations

import numpy as np
import pytest

from flexarm_bringup.sim.hardware import Hardware
from flexarm_controller.guard import STOPPED
from flexarm_controller.guarding.obedience import OPPOSED
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

ARMED, STOP, END = 0.3, 0.35, 2.5  # s


@pytest.mark.parametrize(
    ("name", "preset", "axis"), [("single_link", "geared", 0), ("variable_stiffness", "", 1)]
)
def test_an_arm_that_is_driven_on_by_braking_ends_under_closed_brakes(
    name: str, preset: str, axis: int
) -> None:
    """599 rad/s and 2335 rad had come of it: a guard that stood still checked nothing any more."""
    hardware = Hardware(load_config(find_manipulator(name), preset or None))
    hardware.observe()
    guard, label = hardware.guard, f"axis {axis + 1} "
    speeds = []
    for k in range(round(END / hardware.dt)):
        if k == round(ARMED / hardware.dt):
            assert guard.arm(hardware.t, 7)
        if k == round(STOP / hardware.dt):
            guard.stop("stopped by ~/stop")
        tau = list(hardware.choose_torque(None))
        tau[axis] = 2 * guard.holding[axis] - tau[axis]
        hardware.drives.tau = tau
        hardware.advance()
        speeds.append(abs(hardware.rig.plant.theta_dot))
    most, motion = guard.limits.velocity[axis], np.array(speeds)
    inertia = hardware.rig.plant.tree.mass_matrix(hardware.rig.plant.q)[
        [hardware.rig.plant.tree.actuated[axis]] * 2
    ]
    gained = 2 * OPPOSED * guard.limits.effort[axis] / inertia[0, hardware.rig.plant.tree.actuated[axis]]
    print(f"{name}: {motion.max():.1f} of {most:.1f} rad/s, then {motion[-1].max():.1g}")
    assert most < motion.max() < most + gained
    assert not hardware.drives.is_released and motion[-1].max() < 1e-3
    assert guard.mode == STOPPED and guard.reason.startswith(label) and guard.reason.count("sign") == 1
