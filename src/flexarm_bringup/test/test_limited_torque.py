"""Periods in which the guard limited a torque are counted, and the page of a modal test tells their share."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from flexarm_bringup.excite.limited_torque import limited_share
from flexarm_bringup.excite.measure import MeasuredTest
from flexarm_bringup.excite.page import limited_part, plan_table
from flexarm_bringup.excite.plan import Plan
from flexarm_model.identification.excitation import excitation

RATE_HZ = 100.0
EFFORT, EFFORT_RATE = (2.0, 5.0), (100.0, 300.0)  # N m, N m/s: 1 and 3 N m in a period


def torques() -> Any:
    """Return torques of two axes that keep clear of their limits, (100, 2)."""
    return np.sin(2 * np.pi * np.arange(100) / 50)[:, None] * np.array([1.9, 4.9])


def measured(tau: Any, limits: tuple[Any, Any]) -> MeasuredTest:
    """Return a test of one run that recorded those torques."""
    signal = excitation("multisine", (1.0, 30.0), RATE_HZ, 1.0)
    plan = Plan(signal, np.ones((1, 2)), np.array([1.0, 2.0]), "range of a", 0.3, 0, 1, (), *limits)
    columns = dict(zip("ab", tau.T, strict=True))
    record = SimpleNamespace(
        inputs=columns, instruments=dict(zip("ab", plan.added(0).T, strict=True)), rate_hz=RATE_HZ
    )
    return cast(MeasuredTest, SimpleNamespace(axes=("a", "b"), plan=plan, records=(record,)))


def test_a_torque_within_its_limits_was_not_changed() -> None:
    assert limited_share(torques(), EFFORT, EFFORT_RATE, 1.0 / RATE_HZ) == 0.0


def test_torques_at_their_limit_and_at_that_of_their_rate_are_counted_once_a_period() -> None:
    tau = torques()
    tau[10:14, 0], tau[12:15, 1] = 2.0, -5.0  # there and back 5 N m and more: the second axis' rate, too
    jumps = [12, 15]
    assert abs(np.diff(tau[:, 1]))[np.array(jumps) - 1].min() > 3.0
    assert limited_share(tau, EFFORT, EFFORT_RATE, 1.0 / RATE_HZ) == pytest.approx(6 / 100)


def test_the_page_tells_what_the_drives_gave_and_how_often_the_guard_limited_it() -> None:
    tau = torques()
    tau[12, 0] = 2.0
    table = plan_table(measured(tau, (EFFORT, EFFORT_RATE)))
    assert table.rows[0] == ["a", 1.0, 2.0] and "in 1 % of the periods a torque was at its limit" in str(
        table
    )
    assert "at its limit" not in str(plan_table(measured(torques(), (EFFORT, EFFORT_RATE))))


def test_a_bag_that_tells_no_limits_is_read_as_one() -> None:
    assert limited_part(measured(10.0 * torques(), ((), ()))) == 0.0
