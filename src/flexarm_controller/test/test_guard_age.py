"""How old commands may be: a law may count on a long delay, but one that bears no lost command is refused."""

from dataclasses import replace

import pytest
from guarded_arm import LIMITS, REST, TOKEN

from flexarm_controller.due_commands import DueCommands
from flexarm_controller.guard import ARMED, BRAKING, Guard, GuardCommand

FIRST = 1e5  # s; where doubles are coarse


def run(delay, period, lost=(), periods=400):
    """Let a law with a delay of so many periods command an arm, but for the commands that are lost."""
    guard, waiting = Guard(replace(LIMITS, period=period)), DueCommands(period)
    guard.arm(FIRST, TOKEN)
    for k in range(periods):
        stamp, now = FIRST + k * period, FIRST + (k + 1) * period
        if k not in lost:
            waiting.add(GuardCommand(stamp, k, TOKEN, (0.1, 0.1), "", FIRST + (k + delay) * period))
        guard.step(waiting.take(now), REST, now)
    return guard


@pytest.mark.parametrize(
    ("delay", "period"),
    [(1, 0.005), (3, 0.005), (9, 0.005), (4, 0.01), (3, 0.0125), (1, 0.02), (1, 0.025)],
)
def test_a_delay_that_leaves_a_period_runs_and_bears_a_lost_command(delay, period):
    guard = run(delay, period, lost=(100,))
    assert guard.mode == ARMED, guard.reason
    assert guard.refused == 0


@pytest.mark.parametrize(("delay", "period"), [(10, 0.005), (5, 0.01), (4, 0.0125), (2, 0.02), (2, 0.025)])
def test_a_delay_that_leaves_no_period_is_refused_from_the_first_command_on(delay, period):
    """Such a law would run until the first command is lost or late, after who knows how long."""
    guard = run(delay, period, periods=round(2.2 / period))
    assert guard.mode == BRAKING and guard.passed == 0
    after = 1e3 * delay * period
    assert f"command acts {after:.0f} ms after its state: of 50 ms no period is left" in guard.reason


@pytest.mark.parametrize("k", range(20))
def test_rounding_does_not_decide_whether_a_command_is_too_old(k):
    """A stamp exactly 50 ms ago passes at every instant, also where doubles make it a little more."""
    guard, now = Guard(LIMITS), FIRST + 0.1 * k + 0.05
    guard.arm(now, TOKEN)
    guard.step(GuardCommand(now - 0.05 - 1e-10, 1, TOKEN, (0.1, 0.1)), REST, now)
    assert guard.passed == 1
    guard.step(None, REST, now + 1e-10)
    assert guard.mode == ARMED
