"""What row 44 counts when a guard wakes, and row 45 when an estimator begins anew."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np

from flexarm_bringup.fault_drill.live_restart_rows import unsure_states
from flexarm_bringup.fault_drill.process_rows import passed_since

HIT = 100.0


def status(stamp: float, passed: int) -> Any:
    sec, part = divmod(stamp, 1.0)
    header = SimpleNamespace(stamp=SimpleNamespace(sec=int(sec), nanosec=round(1e9 * part)))
    return SimpleNamespace(header=header, passed=passed)


FROZEN = HIT + 0.5  # s


def test_what_a_frozen_guard_had_said_before_comes_when_it_wakes_and_does_not_count() -> None:
    """As heard of a 3RRR on a busy machine: 24 commands that passed before it was frozen."""
    told = [(-0.125, 715), (-0.025, 734), (0.005, 739), (1.28, 739)]
    assert passed_since([(HIT + 1.25, status(HIT + at, passed)) for at, passed in told], FROZEN) == 0


def test_commands_that_pass_afterwards_count_and_silence_is_no_proof() -> None:
    told = [(HIT + 1.25, status(HIT + 0.005, 739)), (HIT + 1.3, status(HIT + 1.3, 742))]
    assert passed_since(told, FROZEN) == 3
    assert passed_since([], FROZEN) == math.inf
    assert passed_since(told[:1], FROZEN) == math.inf  # it did not wake


def test_a_command_that_passes_in_the_first_cycle_after_waking_counts() -> None:
    """What it had let pass was counted from its first word on, when the first old command had passed."""
    told = [(HIT, status(HIT - 0.01, 500)), *((HIT + at, status(HIT + at, 501)) for at in (1.2, 1.3))]
    assert passed_since(told, FROZEN) == 1


def state(stamp: float, sigma: float, status: int = 0) -> Any:
    """Return the state of one axis: theta, theta' and one more that does not count."""
    msg = status_at(stamp)
    msg.covariance = list(np.diag([sigma**2, 1e-8, 9.0]).ravel())
    msg.status, msg.STARTING, msg.LOST = status, 3, 4
    return msg


def status_at(stamp: float) -> Any:
    return status(stamp, 0)


def test_states_are_unsure_until_the_first_with_a_small_3_sigma_that_may_be_used() -> None:
    states = [state(0.0, 2.0), state(1.0, 0.5, status=3), state(2.0, 0.5), state(3.0, 2.0)]
    assert unsure_states(states, np.array([2.0, 1.0]), 3.0) == {0.0, 1.0}
    assert unsure_states(states, np.array([2.0, 1.0]), 2.9) == {0.0, 1.0, 2.0, 3.0}
