"""Which torque acts where guard and drives do not say the same."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from flexarm_estimator.messages.applied_torque import AppliedTorque, Torque

PERIOD = 5_000_000  # ns
LIMIT = 10.0  # N m


def acted(told: Sequence[float | None], measured: Sequence[float | None]) -> list[float]:
    """Return the torque at the end of every period, of what was told from its begin on and measured in it."""
    acting, ends = AppliedTorque([LIMIT]), []
    acting.changes_before(0, None)
    for k, (wanted, felt) in enumerate(zip(told, measured, strict=True)):
        if wanted is not None:
            acting.tell(Torque(k * PERIOD, np.array([wanted])))
        acting.measure(None if felt is None else np.array([felt]))
        for torque in acting.changes_before((k + 1) * PERIOD, k * PERIOD):
            acting.tau = torque.tau
        ends.append(float(acting.tau[0]))
    return ends


def test_drives_that_do_not_obey_are_right_until_they_closely_agree() -> None:
    """Drives that braked by themselves came within 0.05 of the limit of what the guard wanted meanwhile.

    A single link was led with up to 1.4 N m that did not act, and its encoder doubted for it.
    """
    told = [-3.3, -3.0, -2.7, -2.2, -1.7, -1.4, -1.3]
    measured = [-1.0, -1.0, -1.4, -1.8, -1.5, -1.4, -1.35]
    assert acted(told, measured) == [*measured[:5], *told[5:]]


def test_what_a_guard_told_last_acts_for_a_while_and_no_longer() -> None:
    """A guard that is gone leaves the drives, which brake, less than 0.05 of the limit from its last word."""
    told = [1.0, *[None] * 20]
    measured = [1.0, *np.linspace(0.95, 0.6, 20)]
    ends = acted(told, measured)
    assert ends[:10] == [1.0] * 10
    assert ends[10:] == measured[10:]


@pytest.mark.parametrize("silent", [[2, 3], [3, 5]])
def test_drives_that_measure_nothing_for_a_while_are_as_they_were(silent: list[int]) -> None:
    """Whatever is told meanwhile: a flood of forged torques acted wherever a measurement was missing."""
    told = [1.0, 1.0, 2.0, None, 2.0, 2.0, 2.0]
    measured = [1.0, 5.0, 5.5, 6.0, 6.5, 7.0, 2.0]
    ends = acted(told, [None if k in silent else tau for k, tau in enumerate(measured)])
    expected = list(measured)
    for k in silent:
        expected[k] = ends[k - 1]
    assert ends == expected


def test_drives_that_have_fallen_silent_leave_the_guard_to_be_believed() -> None:
    told = [1.0, *[2.0] * 19]
    measured = [1.0, 5.0, *[None] * 18]
    ends = acted(told, measured)
    assert ends[:12] == [1.0, *[5.0] * 11]
    assert ends[12:] == [2.0] * 8


def test_a_guard_that_agrees_again_without_a_new_word_is_believed_again() -> None:
    assert acted([1.0, 1.0, None, 1.0], [1.0, 3.0, 1.05, 1.05]) == [1.0, 3.0, 1.0, 1.0]
