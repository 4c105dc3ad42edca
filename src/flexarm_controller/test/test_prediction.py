"""The stacked prediction does what step-by-step simulation does."""

import numpy as np
from served_arms import two_axes

from flexarm_controller.program.prediction import plant, predict


def test_stacked_states_equal_a_simulation_with_torques_held_over_blocks():
    system, blocks = plant(two_axes(), 0.01), (1, 1, 3, 2)
    prediction = predict(system, blocks)
    rng = np.random.default_rng(1)
    x, d, v = rng.standard_normal(10), rng.standard_normal(2), rng.standard_normal((4, 2))
    stacked = prediction.F @ x + prediction.H @ d + prediction.h + prediction.G @ v.ravel()
    simulated = []
    for torque in np.repeat(v, blocks, axis=0):
        x = system.A @ x + system.B @ (torque + d) + system.c
        simulated.append(x)
    np.testing.assert_allclose(stacked, np.concatenate(simulated), atol=1e-10)
    np.testing.assert_array_equal((prediction.T @ v.ravel()).reshape(-1, 2), np.repeat(v, blocks, axis=0))
