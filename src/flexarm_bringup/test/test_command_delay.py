"""In the rig with its guard a torque acts when its law says, not before."""

from __future__ import annotations

import numpy as np
import pytest

from flexarm_bringup.closed_loop import LoopSettings, run_closed_loop
from flexarm_bringup.demo_run.motions import motions, out_and_back
from flexarm_bringup.sim.hardware import Hardware
from flexarm_controller.guard import GuardCommand
from flexarm_controller.settings import MpcConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator


@pytest.fixture(scope="module")
def arm():
    return load_config(find_manipulator("single_link"), "geared")


def test_a_command_of_two_periods_acts_two_periods_after_its_state(arm):
    hardware, torques = Hardware(arm), []
    hardware.observe()
    hardware.guard.arm(0.0, 1)
    for k in range(6):
        stamp, effort = hardware.t, (0.01 * (k + 1),)
        hardware.advance()
        command = GuardCommand(stamp, k, 1, effort, acts_at=stamp + 2 * hardware.dt)
        torques.append(hardware.choose_torque(command)[0])
        assert hardware.is_commanded == (k > 0)
    assert torques == pytest.approx([0.0, 0.01, 0.02, 0.03, 0.04, 0.05])


@pytest.mark.parametrize("delay", [1, 2, 4])
def test_the_law_bears_the_delay_that_it_counts_on(arm, delay):
    """A law that counted on one period while there are four would shake the arm."""
    moves = out_and_back([0.2], "A", "ZVD", motions(0.015))
    record = run_closed_loop(arm, moves, LoopSettings(mpc=MpcConfig(time_limit=0.0, delay_periods=delay)))
    late = record.t > record.t[-1] - 0.5
    assert abs(record.theta[late]).max() < 1e-3
    assert np.sqrt(np.mean(record.relative[late] ** 2)) < 0.1
    assert record.fresh[delay:].all() and not record.fresh[: delay - 1].any()
