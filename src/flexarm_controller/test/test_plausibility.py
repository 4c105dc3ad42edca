"""The check of positions against velocities by itself: what it says from period to period."""

import math

import pytest
from test_guard_plausibility import CHECKED, T, turning

from flexarm_controller.guard import GuardState
from flexarm_controller.guarding.plausibility import Plausibility


def looks(motion, periods):
    """Return what a check of its own says of a motion, period by period: velocities, fault, switch."""
    check = Plausibility(CHECKED)
    for k in range(periods):
        velocity = check.look(GuardState(*reversed(motion(k * T))), k * T).velocity
        yield velocity, check.fault, check.has_switched


def test_nothing_is_switched_while_all_is_plausible():
    assert not any(fault or switched for _, fault, switched in looks(turning, 200))


def test_a_position_that_creeps_beside_a_fast_velocity_is_not_believed_before_it_has_left_its_noise():
    said = list(looks(lambda t: ((0.1 * t, 0.0), (1.0, 0.0)), 60))
    first = next(k for k, (_, fault, _) in enumerate(said) if fault)
    later = next(k for k, (_, _, switched) in enumerate(said) if switched)
    assert later > first and [velocity[0] for velocity, _, _ in said[:later]] == [1.0] * later
    assert said[later][0][0] == pytest.approx(0.1, abs=0.02)
    assert sum(switched for _, _, switched in said) == 1


def test_a_position_beyond_all_numbers_gives_no_velocity_beyond_them():
    said = list(looks(lambda t: ((0.0 if t < 0.3 else math.inf, 0.0), (0.0, 0.0)), 100))
    assert any(fault for _, fault, _ in said)
    assert all(math.isfinite(v) for velocity, _, _ in said for v in velocity)
