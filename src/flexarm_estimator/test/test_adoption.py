from dataclasses import replace

import numpy as np
import pytest
from planar_strip import DT, SENSORS, StripKinematics, arriving, simulate, strip_model

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.filter import Belief
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.state.state_map import state_map

MODEL = strip_model()


def turned_model(angle=0.4, pose=0.3):
    """Return the same arm about another pose with its modes mixed: equal physics, other coordinates."""
    mix = np.eye(4)
    mix[1:3, 1:3] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    mix[:, [2, 3]] = mix[:, [3, 2]]  # and two of them swapped
    outputs = MODEL.outputs
    rows = {name: getattr(outputs, name) @ mix for name in ("C_pos", "C_vel", "C_acc")}
    y0 = outputs.y0 + outputs.C_pos[:, 0] * pose
    M, D, K = (mix.T @ part @ mix for part in (MODEL.M, MODEL.D, MODEL.K))
    return replace(
        MODEL, pose=np.array([pose]), M=M, D=D, K=K, B=mix.T @ MODEL.B, q0=np.array([pose, 0.0, 0.0, 0.0]),
        Phi=MODEL.Phi @ mix, outputs=replace(outputs, y0=y0, **rows),
    )  # fmt: skip


def coordinates(model, x):
    return model.q0 + model.Phi @ (x[:4] - model.xi0), model.Phi @ x[4:8]


def random_belief(rng):
    root = rng.normal(size=(9, 9))
    return Belief(rng.normal(size=9), root @ root.T)


def test_equal_models_give_the_identity():
    mapping = state_map(MODEL, strip_model(0.01))
    np.testing.assert_array_equal(mapping.T, np.eye(9))


def test_the_new_state_describes_the_same_motion_of_the_tree():
    new = turned_model()
    belief = random_belief(np.random.default_rng(1))
    moved = state_map(MODEL, new).apply(belief)
    for before, after in zip(coordinates(MODEL, belief.x), coordinates(new, moved.x), strict=True):
        np.testing.assert_allclose(after, before, atol=1e-12)
    assert moved.x[0] == belief.x[0]
    assert moved.x[8] == belief.x[8]


def test_the_vibration_stays_when_the_static_shape_of_the_new_pose_is_another():
    bent = replace(turned_model(), q0=np.array([0.3, 0.01, -0.02, 0.005]))  # as a loop or gravity makes it
    belief = random_belief(np.random.default_rng(6))
    moved = state_map(MODEL, bent).apply(belief)
    np.testing.assert_allclose(bent.Phi[:, 1:] @ moved.x[1:4], MODEL.Phi[:, 1:] @ belief.x[1:4], atol=1e-12)
    np.testing.assert_allclose(bent.Phi[:, 1:] @ moved.x[5:8], MODEL.Phi[:, 1:] @ belief.x[5:8], atol=1e-12)
    np.testing.assert_array_equal(moved.x[[0, 4, 8]], belief.x[[0, 4, 8]])


def test_there_and_back_is_the_identity():
    new = turned_model()
    belief = random_belief(np.random.default_rng(2))
    back = state_map(new, MODEL).apply(state_map(MODEL, new).apply(belief))
    np.testing.assert_allclose(back.x, belief.x, atol=1e-12)
    np.testing.assert_allclose(back.P, belief.P, atol=1e-11)


def test_projection_with_the_mass_matrix_leaves_no_momentum_in_what_is_lost():
    rng = np.random.default_rng(3)
    root = rng.normal(size=(4, 4))
    W = root @ root.T + np.eye(4)
    fewer = replace(turned_model(), Phi=turned_model().Phi[:, :3], omega=MODEL.omega[:2], zeta=MODEL.zeta[:2],
                    M=np.eye(3), K=np.eye(3), D=np.eye(3))  # fmt: skip
    mapping = state_map(MODEL, fewer, W)
    x = rng.normal(size=9)
    rate_new = (mapping.T @ x)[3:6]
    lost = MODEL.Phi @ x[4:8] - fewer.Phi @ rate_new
    np.testing.assert_allclose(fewer.Phi[:, 1:].T @ W @ lost, 0.0, atol=1e-10)


def test_an_estimator_that_adopts_a_turned_model_goes_on_as_if_nothing_had_happened():
    record = simulate(300, np.random.default_rng(4), camera_every=7)
    steady, adopting = (Estimator(MODEL, StripKinematics(), SENSORS, EstimatorConfig()) for _ in range(2))
    for k in range(301):
        if k == 150:
            adopting.adopt(turned_model())
        a, b = (e.step(arriving(record, k, 12), record.tau[k], k * DT) for e in (steady, adopting))
        if k == 150:  # one step with the process noise of mixed modes, which differs a little
            sigma = np.sqrt(np.trace(a.cov_tip_pose[:3, :3]))
            assert np.linalg.norm(b.T_world_tip[:3, 3] - a.T_world_tip[:3, 3]) < 0.2 * sigma
    assert b.model_id != a.model_id
    assert b.status == "ok"
    sigma = np.sqrt(np.trace(a.cov_tip_pose[:3, :3]))
    assert np.linalg.norm(b.T_world_tip[:3, 3] - a.T_world_tip[:3, 3]) < 3 * sigma


def test_samples_from_before_adoptions_lead_where_they_would_have_led_in_time():
    """Frames 12 periods late, gauges 3, over five adoptions: each is fused with the model of its own time."""
    record = simulate(165, np.random.default_rng(5), camera_every=7)
    late, in_time = (Estimator(MODEL, StripKinematics(), SENSORS, EstimatorConfig()) for _ in range(2))
    turned = {60: 0.4, 61: -0.2, 90: 0.1, 148: 0.3, 151: 0.7}
    last = 152  # sample
    for k in range(last + 13):
        if k in turned:
            late.adopt(turned_model(turned[k]))
            in_time.adopt(turned_model(turned[k]))
        a = late.step(delayed(record, k, last), record.tau[k], k * DT)
        b = in_time.step(record.samples[k] if k <= last else [], record.tau[k], k * DT)
    sigma = np.sqrt(np.diag(b.P))
    assert np.max(np.abs(a.x - b.x) / sigma) < 1e-9
    assert np.max(np.abs(a.P - b.P) / np.outer(sigma, sigma)) < 1e-9


def delayed(record, k, last):
    """Return what of the samples up to ``last`` arrives at k: encoders at once, frames late, others a bit."""
    delays = {"encoder": 0, "camera": 12}
    taken = [(k - delays.get(spec.name, 3), spec.name) for spec in SENSORS]
    return [s for i, name in taken if 0 <= i <= last for s in record.samples[i] if s.sensor == name]


def test_a_model_of_another_arm_is_refused():
    stranger = replace(MODEL, theta_names=("elbow.rz",))
    with pytest.raises(ValueError, match="elbow.rz cannot follow one of base.rz"):
        state_map(MODEL, stranger)
