"""What sound drives tell is never doubted, however the arm is thrown about and however noisy encoders are."""

from __future__ import annotations

import random

import pytest

from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.motor_side import SMOOTHING
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.sim.sensor_faults import SensorFault
from flexarm_controller.guard import ARMED, STOPPED, GuardCommand
from flexarm_controller.guarding.settings import GuardSettings
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

MACHINES = ("single_link", "variable_stiffness", "planar_3rrr", "spatial_3tpt", "serial_6r")
SLOW = [pytest.param(name, marks=pytest.mark.slow) for name in MACHINES[2:]]
TIMES_NOISE = 3.0
PERIODS = 3000  # a 3RRR without gears creeps for 13 s until it is at rest and can be armed again


def test_the_guard_takes_the_drives_to_smooth_as_those_of_the_rig_do() -> None:
    assert GuardSettings().velocity_smoothing == SMOOTHING


def thrown_about(hardware: Hardware, periods: int) -> int:
    """Push the arm at random, arm it again after every stop; return how often that was."""
    rng, guard, stops = random.Random(3), hardware.guard, 0
    hardware.observe()
    assert guard.arm(0.0, 1)
    for k in range(periods):
        if k % 40 == 0:
            push = [rng.uniform(-1.0, 1.0) * most for most in guard.limits.effort]
        if guard.mode == STOPPED:
            stops += guard.arm(hardware.t, 1)
        command = GuardCommand(hardware.t, k + 1, guard.token, tuple(push))
        hardware.choose_torque(command if guard.mode == ARMED else None)
        assert guard._plausibility.fault == "", f"{hardware.t} s"
        hardware.advance()
    return stops


@pytest.mark.parametrize("name", [*MACHINES[:2], *SLOW])
def test_no_drive_of_the_five_arms_is_doubted_with_three_times_the_noise(name: str) -> None:
    hardware = Hardware(load_config(find_manipulator(name)), RigSettings(noise=TIMES_NOISE))
    assert thrown_about(hardware, PERIODS) > 0


@pytest.mark.parametrize("kind", ["off", "stuck", "garbage", "nan", "bias", "wrong"])
def test_a_fault_of_encoders_that_drives_do_not_have_is_none_of_the_guards(kind: str) -> None:
    config = load_config(find_manipulator("single_link"))
    hardware = Hardware(config, faults={"encoder": SensorFault(kind, 0.2, 1.0)})
    thrown_about(hardware, 300)


def test_drives_whose_own_velocity_is_stuck_are_stopped_by_the_guard_and_braked() -> None:
    """In a steady turn of 1 rad/s; the way of the stop is that of a sound one and of the time to notice."""
    hardware = Hardware(load_config(find_manipulator("single_link")))
    hardware.observe()
    guard, told = hardware.guard, hardware.drives.own
    assert guard.arm(0.0, 1)
    for k in range(600):
        speed = hardware.rig.plant.theta_dot[0]
        effort = (2.0 * (1.0 - speed),)
        command = GuardCommand(hardware.t, k + 1, guard.token, effort)
        hardware.choose_torque(command if guard.mode == ARMED else None)
        hardware.advance()
        if k == 300:
            begin = hardware.rig.plant.theta[0]
            assert speed == pytest.approx(1.0, abs=0.1)
        if k >= 300:
            told.velocity = [0.0]
    assert guard.mode == STOPPED and guard.reason.startswith("axis 1 (base.rz) went ")
    way, a = hardware.rig.plant.theta[0] - begin, guard.limits.braking.deceleration[0]
    assert way < 0.04 * 1.0 + 1.05 * 1.0**2 / (2.0 * a)
    assert abs(hardware.rig.plant.theta_dot[0]) < 0.01
