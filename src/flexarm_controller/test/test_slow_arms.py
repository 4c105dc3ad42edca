"""Arms of slow control rates: the silence that stops them is one of periods, or no command would pass."""

from dataclasses import replace

import pytest

from flexarm_controller.guard import ARMED, Guard, GuardCommand, GuardState
from flexarm_controller.guard_settings import GuardNodeSettings, GuardSettings, guard_limits
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.tree.reduced_tree import ReducedTree


@pytest.fixture(scope="module")
def limits_at():
    tree = ReducedTree(load_config(find_manipulator("single_link")), use_compiler=False)
    return lambda rate: guard_limits(replace(tree.config, rate_hz=rate), tree, GuardSettings())


@pytest.mark.parametrize(("rate", "silence"), [(200.0, 0.05), (60.0, 0.05), (20.0, 0.15), (10.0, 0.3)])
def test_a_slow_arm_may_be_without_a_command_for_three_periods(limits_at, rate, silence):
    assert limits_at(rate).max_age == pytest.approx(silence)


def test_drives_may_be_silent_for_three_periods_too():
    silence = GuardNodeSettings().longest_silence
    assert [silence(period) for period in (0.005, 0.05)] == [0.035, pytest.approx(0.15)]


@pytest.mark.parametrize("delay", [1, 2])
def test_commands_of_a_slow_arm_pass_also_when_one_is_lost(limits_at, delay):
    guard, period = Guard(limits_at(20.0)), 0.05
    guard.arm(0.0, 1)
    for k in range(1, 40):
        computed = (k - 1) * period
        command = GuardCommand(computed, k, 1, (0.01,), acts_at=computed + delay * period)
        guard.step(None if k == 20 else command, GuardState((0.0,), (0.0,), ()), k * period)
    assert guard.mode == ARMED and guard.passed == 38
