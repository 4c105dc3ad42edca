"""Commands that wait for their period."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st

from flexarm_controller.due_commands import FARTHEST, DueCommands
from flexarm_controller.guard import GuardCommand

T = 0.002


def command(k, acts_at):
    return GuardCommand(k * T, k, 1, (0.0,), acts_at=acts_at)


def test_a_command_acts_when_its_period_begins_and_once():
    due = DueCommands(T)
    due.add(command(0, 2 * T))
    assert not due.has(T) and due.take(T) is None
    assert due.has(2 * T)
    taken = due.take(2 * T)
    assert taken is not None and taken.sequence == 0
    assert not due.has(2 * T) and due.take(2 * T) is None


def test_one_that_came_too_late_acts_where_there_is_no_other_but_is_not_waited_for():
    due = DueCommands(T)
    due.add(command(0, 2 * T))
    assert not due.has(3 * T)
    assert due.take(3 * T) == command(0, 2 * T)
    due.add(command(1, 3 * T))
    due.add(command(2, 4 * T))
    assert due.take(4 * T) == command(2, 4 * T)
    assert due.take(5 * T) is None


def test_one_without_a_period_acts_at_once():
    due = DueCommands(T)
    due.add(command(0, -math.inf))
    assert not due.has(0.0)  # nobody can know which one it is for
    assert due.take(0.0) == command(0, -math.inf)


def test_one_that_is_meant_for_a_far_future_is_forgotten_and_holds_nobody_up():
    due = DueCommands(T)
    due.add(command(0, 1e3))
    due.add(command(1, T))
    assert due.take(T) == command(1, T)
    assert due.take(1e3) is None
    due.add(command(2, 1e3))
    due.clear()
    assert due.take(1e3) is None


@given(st.lists(st.integers(0, FARTHEST + 20), max_size=40))
def test_no_more_wait_than_periods_ahead_can_be_meant(delays):
    due, most = DueCommands(T), 0
    for k, delay in enumerate(delays):
        due.add(command(k, (k + delay) * T))
        taken = due.take(k * T)
        assert taken is None or taken.acts_at < (k + 0.5) * T
        most = max(most, len(due._waiting))
    assert most <= FARTHEST + 1
