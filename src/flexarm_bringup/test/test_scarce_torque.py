"""Scarce torque holds an arm of any weight wherever its task leads; torque rates begin at what holds it."""

from __future__ import annotations

from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from flexarm_bringup.fault_drill.controller_stand import ControllerStand
from flexarm_bringup.fault_drill.solver_rows import _limits_kept


@cache
def stand() -> ControllerStand:
    """Return an arm whose motors carry springs and weight."""
    return ControllerStand("variable_stiffness")


@pytest.mark.parametrize("share", [0.0, 0.2])
def test_scarce_torque_holds_the_arm_at_every_pose_of_its_task(share: float) -> None:
    reference = stand().loop.course.reference
    theta = np.array([reference.position(t) for t in np.linspace(reference.t[0], reference.t[-1], 997)])
    assert (abs(stand().held_at(theta)) <= stand().scarce(share).effort * (1.0 + 1e-3)).all()


def test_scarce_torque_leaves_a_share_of_what_moves_the_arm() -> None:
    left = stand().scarce(0.2).effort - stand().weight
    moved = stand().used > 1e-3  # N m
    np.testing.assert_allclose(left[moved], 0.2 * stand().used[moved])
    assert (stand().weight > 0.1).any() and moved.any()


def kept(first: list[float]) -> bool:
    """Tell if the rate is kept by torques that begin so, on an arm that takes 3 of 10 N m to be held."""
    limits = SimpleNamespace(effort=np.array([10.0]), effort_rate=np.array([100.0]))
    arm = SimpleNamespace(holding=np.array([3.0]), limits=limits, dt=0.01)
    commands = [SimpleNamespace(tau=np.array([tau])) for tau in first]
    _, rate = _limits_kept("", commands, arm)  # type: ignore[arg-type]
    return rate.passed


def test_the_first_step_of_torque_begins_at_what_holds_the_arm() -> None:
    assert kept([3.0, 3.9]) and kept([2.1])
    assert not kept([0.0]) and not kept([4.1]) and not kept([3.0, 4.1])
