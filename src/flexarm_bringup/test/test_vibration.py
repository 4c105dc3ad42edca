"""One mode under a moving hub: against closed forms and an independent integrator."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from flexarm_bringup.reproduce.vibration import Damping, Mode, PowerLaw, Vibration, constant, simulate
from flexarm_model.motion.profiles import Quintic, Trapezoid

MODE = Mode(2.0 * math.pi * 5.23, 0.6854)
MOVE = Quintic(0.5, 0.4)


def integrate(damping: Damping, t: np.ndarray) -> np.ndarray:
    """Deflection by an adaptive eighth-order integrator that knows nothing of samples."""

    def rate(time: float, state: np.ndarray) -> list[float]:
        y, y_dot = state
        zeta = damping(math.hypot(y_dot, MODE.omega * y))
        push = MODE.participation * float(MOVE.sample(time)[2][0])
        return [y_dot, -2.0 * zeta * MODE.omega * y_dot - MODE.omega**2 * y - push]

    solution = solve_ivp(rate, (0.0, t[-1]), [0.0, 0.0], "DOP853", t, rtol=1e-10, atol=1e-14, max_step=0.01)
    return np.asarray(solution.y[0])


@pytest.mark.parametrize("damping", [constant(0.0), constant(0.1), PowerLaw(0.05)])
def test_steps_converge_to_an_independent_integrator(damping: Damping) -> None:
    off = []
    for rate_hz in (256.0, 512.0, 1024.0):
        vibration = simulate(MOVE, MODE, damping, rate_hz, int(1.5 * rate_hz))
        exact = integrate(damping, vibration.t)
        off.append(np.abs(vibration.deflection - exact).max() / np.abs(exact).max())
    assert off[0] / off[1] > 1.6  # first order (2), less where v^0.3 is singular at rest
    assert off[1] / off[2] > 1.6
    assert off[2] < 2e-3


def free_part(vibration: Vibration, after: float) -> tuple[np.ndarray, np.ndarray]:
    late = vibration.t > after
    return vibration.t[late], vibration.deflection[late]


def test_vibration_after_the_motion_is_an_exact_damped_sine() -> None:
    zeta = 0.03
    t, y = free_part(simulate(MOVE, MODE, constant(zeta), 512.0, 1500), 0.5)
    omega_d = MODE.omega * math.sqrt(1.0 - zeta**2)
    basis = np.exp(-zeta * MODE.omega * t)[:, None] * np.column_stack(
        [np.cos(omega_d * t), np.sin(omega_d * t)]
    )
    fit, *_ = np.linalg.lstsq(basis, y, rcond=None)
    np.testing.assert_allclose(basis @ fit, y, atol=1e-12 * np.abs(fit).max())


def test_steady_acceleration_bends_the_arm_by_the_quasi_static_amount() -> None:
    move = Trapezoid(10.0, 4.0, 2.0, 2.0)
    vibration = simulate(move, MODE, constant(0.3), 512.0, 1000)
    static = -MODE.participation * (move.omega_max / move.t_a) / MODE.omega**2
    assert vibration.deflection[-1] == pytest.approx(static, rel=1e-6)
    assert vibration.acceleration[-1] == pytest.approx(0.0, abs=1e-6)


def test_power_law_grows_with_speed_and_is_capped() -> None:
    law = PowerLaw(0.032)
    assert law(0.0) == 0.0
    assert law(1.0) == pytest.approx(0.032)
    assert law(2.0) / law(1.0) == pytest.approx(2.0**0.3)
    assert law(1e9) == 0.5
