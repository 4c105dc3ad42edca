"""The gradient that the reference adds, read from a table of several windows."""

import numpy as np
import pytest

from flexarm_controller.program.preview import WINDOWS, Preview
from flexarm_controller.reference import Reference
from flexarm_model.motion.profiles import Quintic

HORIZON, DT = 5, 0.01


def moving():
    """Return two axes on one profile."""
    times = np.linspace(0.0, 0.5, 26)
    return Reference(times, *(np.outer(part, [1.0, -0.3]) for part in Quintic(0.7, 0.5).sample(times)))


def gradient_of(Q_r, reference, t):
    window = np.hstack(reference.sample(t + np.arange(HORIZON + 1) * DT))
    return Q_r @ window.ravel()


def test_every_period_gets_the_gradient_of_its_own_window():
    Q_r = np.random.default_rng(1).normal(size=(4, 6 * (HORIZON + 1)))
    preview, reference = Preview(Q_r, HORIZON, DT, lambda gradients: 2 * gradients), moving()
    for k in range(3 * WINDOWS):
        expected = gradient_of(Q_r, reference, k * DT)
        gradient, twice = preview.look(reference, k * DT)
        np.testing.assert_allclose(gradient, expected, rtol=1e-12, atol=1e-12)
        np.testing.assert_array_equal(twice, 2 * gradient)


@pytest.mark.parametrize("jump", [0.0, -0.07, 0.0043, 10.0])
def test_a_jump_of_time_and_another_reference_are_seen(jump):
    Q_r = np.random.default_rng(2).normal(size=(3, 6 * (HORIZON + 1)))
    preview = Preview(Q_r, HORIZON, DT, lambda gradients: 2 * gradients)
    for t, reference in ((0.1, moving()), (0.1 + jump, moving()), (0.1 + jump + DT, moving())):
        expected = gradient_of(Q_r, reference, t)
        np.testing.assert_allclose(preview.look(reference, t)[0], expected, rtol=1e-12, atol=1e-12)
