"""The plan that no limit touches: the affine map against the program it stands for."""

import numpy as np
import pytest
from served_arms import limits_of_hub, single_link, state_of, two_axes, two_axis_limits

from flexarm_controller.mpc import Mpc
from flexarm_controller.program.delay import Delay, torques_kept
from flexarm_controller.program.penalties import Known
from flexarm_controller.program.prediction import plant
from flexarm_controller.reference import Reference
from flexarm_controller.settings import MpcConfig

DT = 0.005
RNG_STATES = 20


def arms():
    return {
        "one axis": (single_link(), limits_of_hub(effort=60.0)),
        "two axes": (two_axes(), two_axis_limits(effort=(80.0, 60.0))),
    }


def ramp(model):
    t = np.array([0.0, 0.4])
    theta = np.vstack([model.pose, model.pose + 0.02])
    return Reference(t, theta, np.zeros_like(theta), np.zeros_like(theta))


def moved(model, rng, size):
    x = size * rng.standard_normal(2 * model.n)
    x[: model.n_theta] += model.pose
    return x


@pytest.mark.parametrize("arm", arms())
@pytest.mark.parametrize("change", [{}, {"delay_periods": 0}, {"delay_periods": 2, "latency": 0.4 * DT}])
def test_the_torques_make_the_gradient_vanish_and_the_distance_is_that_of_the_rows(arm, change):
    (model, limits), config, rng = arms()[arm], MpcConfig(time_limit=0.0, **change), np.random.default_rng(3)
    mpc, reference = Mpc(model, limits, config, DT), ramp(model)
    problem, n_v = mpc.problem, mpc.problem.n_v
    sent = 0.1 * rng.standard_normal((torques_kept(config, DT), model.n_theta))
    seen = set()
    for k in range(RNG_STATES):
        state = state_of(moved(model, rng, 1e-3 * 4.0 ** (k % 4)), model, k * DT, d=[0.1] * model.n_theta)
        plan = mpc.step(state, reference, sent)
        samples = np.hstack(reference.sample(state.t + mpc.lead + DT * np.arange(config.horizon + 1)))
        q, l, u = problem.vectors(mpc.known_now(state, sent), problem.q_r @ samples.ravel())  # noqa: E741
        v = np.linalg.solve(problem.P[:n_v, :n_v], -q[:n_v])
        y = problem.rows.A[:, :n_v] @ v
        touched = problem.rows.A[:, :n_v].any(axis=1)
        margin = min((u - y)[touched].min(), (y - l)[touched].min())
        seen.add(margin >= 0)
        assert (plan.result.status == "solved without limits") == (margin >= 0)
        if margin >= 0:
            np.testing.assert_allclose(plan.result.x[:n_v], v, atol=1e-8)
            assert plan.result.margin == pytest.approx(margin, abs=1e-8)
    assert seen == {True, False}


@pytest.mark.parametrize("change", [{}, {"delay_periods": 0}, {"delay_periods": 3}, {"latency": 0.3 * DT}])
def test_the_map_of_the_delay_is_the_motion_period_by_period(change):
    model, config, rng = two_axes(), MpcConfig(**change), np.random.default_rng(4)
    delay, known = Delay(model, plant(model, DT), config, DT), Known(model.n, model.n_theta, config.horizon)
    kept = torques_kept(config, DT)
    E, e = delay.map(known, kept)
    x, d, sent = moved(model, rng, 0.1), rng.standard_normal(2), rng.standard_normal((kept, 2))
    sag = rng.standard_normal(model.n - 2)
    p_now = E @ np.concatenate([x, d, sent.ravel(), sag]) + e
    vibration = x.copy()
    vibration[2 : model.n] -= sag
    np.testing.assert_allclose(p_now[known.x], delay.advance(vibration, d, sent), rtol=1e-12, atol=1e-12)
    for part, value in ((known.d, d), (known.u_before, sent[-1]), (known.s, sag)):
        np.testing.assert_array_equal(p_now[part], value)
