"""Margins of all torques where roots pass zero at once: those of the same loop, once and three times."""

import numpy as np
import pytest

from flexarm_controller.margins.delay_margin import unstable_zeros
from flexarm_controller.margins.group_margin import group_gain_margin
from flexarm_controller.margins.paired_roots import PairedRoots

POLE = 0.98 * np.exp(1j)  # of the loop as it is; with more gain it leaves the unit circle
ANGLES = np.unique(
    np.concatenate([np.linspace(0.0, np.pi, 40), np.angle(POLE) + np.arange(-19.5, 20.0) * 0.01])
)
SAME = np.array([[2.0, 1.0, 0.0], [0.0, 1.0, 1.0], [1.0, 0.0, 1.0]])  # axes that are mixed


def answer(angles: np.ndarray) -> np.ndarray:
    """Return the answers of a mode to a torque, (k,): its poles move by 0.03 with twice the gain."""
    z = np.exp(1j * angles)
    return 0.03 * ((1 - 0.3j) * POLE / (z - POLE) + ((1 - 0.3j) * POLE).conjugate() / (z - POLE.conjugate()))


def mixed(alike: np.ndarray) -> np.ndarray:
    """Return the matrices (k, 3, 3) of three such loops, the axes mixed."""
    return SAME @ (alike[:, None, None] * np.eye(3)) @ np.linalg.inv(SAME)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_three_loops_alike_have_the_margins_of_one(sign: float) -> None:
    """Margins of the 3RRR were up to 1.1 dB too small: double modes turn a determinant too fast."""
    one, three = (
        group_gain_margin(matrices)
        for matrices in (sign * answer(ANGLES)[:, None, None], sign * mixed(answer(ANGLES)))
    )
    assert (three.up, three.down) == pytest.approx((one.up, one.down), rel=1e-6)
    fine = group_gain_margin(sign * answer(np.linspace(0.0, np.pi, 40_001))[:, None, None])
    assert (one.up, one.down) == pytest.approx((fine.up, fine.down), abs=0.03)


def test_the_determinant_alone_does_not_tell_them() -> None:
    """Else this file would prove nothing."""
    alike = answer(ANGLES)
    share = 1.01 * (group_gain_margin(alike[:, None, None]).up - 1.0)  # the zeros have just left the circle
    assert unstable_zeros(1.0 - share * alike) == 2
    assert unstable_zeros((1.0 - share * alike) ** 3) != 6
    assert PairedRoots(mixed(alike)).unstable_zeros(share) == 6


def test_roots_that_come_in_another_order_are_followed() -> None:
    turning = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 61))
    rng, alike = np.random.default_rng(3), np.array([2.0, 0.5, 3.0, 0.2])
    matrices = np.zeros((61, 4, 4), complex)
    for k, z in enumerate(turning):
        matrices[k] = np.diag(rng.permutation(alike * z))
    assert (
        PairedRoots(matrices).unstable_zeros(1.0) == -4
    )  # two roots go round one, there and back in half turns
