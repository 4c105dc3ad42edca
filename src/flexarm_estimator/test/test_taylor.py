import numpy as np
import pytest
from planar_strip import DT, strip_model
from scipy.linalg import expm

from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.state.process import ProcessModel
from flexarm_estimator.steps.taylor import ExponentialIntegrals
from flexarm_model.served.state_space import discretize


@pytest.mark.parametrize("dt", [1e-6, 1e-4, 3.1e-3, DT, 0.02, 0.1])
@pytest.mark.parametrize("hub_inertia", [0.30, 0.01])
def test_a_step_of_any_length_equals_two_matrix_exponentials(dt, hub_inertia):
    process = ProcessModel(strip_model(hub_inertia), EstimatorConfig())
    step, exact = process.step(dt), discretize(process.system, dt)
    scale = np.sqrt(np.outer(np.diag(exact.Q), np.diag(exact.Q)))
    # Van Loan's own exponential of a stiff matrix is good to about 1e-10 at 0.1 s, ours to rounding
    np.testing.assert_allclose(step.A, exact.A, rtol=1e-9, atol=1e-9 * np.abs(exact.A).max())
    np.testing.assert_allclose(step.B, np.column_stack([exact.B, exact.c]), rtol=1e-9, atol=1e-12)
    assert np.max(np.abs(step.Q - exact.Q) / scale) < 1e-6


def test_two_half_steps_make_a_whole_one():
    process = ProcessModel(strip_model(), EstimatorConfig())
    integrals = ExponentialIntegrals(process.system.A, process.system.Q)
    E, integral, Q = integrals.at(0.004)
    E1, integral1, Q1 = integrals.at(0.0015)
    E2, integral2, Q2 = integrals.at(0.0025)
    scale = np.sqrt(np.outer(np.diag(Q), np.diag(Q)))
    np.testing.assert_allclose(E2 @ E1, E, rtol=1e-12, atol=1e-12 * np.abs(E).max())
    np.testing.assert_allclose(
        integral2 + E2 @ integral1, integral, rtol=1e-12, atol=1e-12 * np.abs(integral).max()
    )
    assert np.max(np.abs(E2 @ Q1 @ E2.T + Q2 - Q) / scale) < 1e-12


def test_the_noise_of_a_short_step_is_that_of_its_leading_order():
    process = ProcessModel(strip_model(), EstimatorConfig())
    Q = process.step(1e-5).Q
    assert Q[4, 4] / (process.system.Q[4, 4] * 1e-5) == pytest.approx(1.0, rel=1e-3)  # velocity: S h
    position = Q[0, 0] / (process.system.Q[4, 4] * 1e-5**3 / 3)  # position: S h^3 / 3
    assert position == pytest.approx(1.0, rel=1e-2)


@pytest.mark.filterwarnings("error")
def test_couplings_that_are_zero_but_for_rounding_neither_warn_nor_change_a_step():
    """Axes of a closed loop without gravity: 1e-28 is left of their stiffness."""
    A = np.array(
        [[0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0], [1e-28, 6e4, 0.0, 2.0], [1e-30, -4e5, 0.0, -8.0]]
    )
    exact = expm(A * DT)
    E = ExponentialIntegrals(A, np.eye(4)).at(DT)[0]
    np.testing.assert_allclose(E, exact, rtol=1e-12, atol=1e-12 * np.abs(exact).max())  # rounding of both
