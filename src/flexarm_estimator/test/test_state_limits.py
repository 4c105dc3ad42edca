"""Learning limits: a bias goes no further, the rest of the state takes what is left, and it is told."""

from dataclasses import replace

import numpy as np
import pytest
from planar_strip import (
    ACCELEROMETER,
    CAMERA,
    DT,
    ENCODER,
    STRAIN_GAUGE,
    StripKinematics,
    simulate,
    strip_model,
)
from scipy.optimize import minimize

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.filter import Belief
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.state.state_limits import StateLimits
from flexarm_model.manipulator.sensor_spec import BiasSpec

GAUGE = replace(STRAIN_GAUGE, bias=BiasSpec(2e-6, 1e-6, 10e-6))
SENSORS = (ENCODER, GAUGE, ACCELEROMETER, CAMERA)
RECORD = simulate(1600, np.random.default_rng(3), camera_every=7)


def belief_with(rng, x):
    root = rng.normal(size=(5, 5))
    return Belief(np.array(x), root @ root.T)


def test_within_its_limits_nothing_is_touched():
    belief = belief_with(np.random.default_rng(1), [1.0, 2.0, 3.0, 0.9, -0.5])
    assert not StateLimits({3: 1.0, 4: 1.0}).hold(belief)
    np.testing.assert_array_equal(belief.x, [1.0, 2.0, 3.0, 0.9, -0.5])


@pytest.mark.parametrize("beyond", [3.0, -3.0])
def test_the_state_led_back_is_the_likeliest_within_the_limits(beyond):
    """Against a numerical minimum of the Mahalanobis distance with the bias bounded."""
    belief = belief_with(np.random.default_rng(2), [1.0, 2.0, 3.0, beyond, 0.2])
    free, precision = belief.x.copy(), np.linalg.inv(belief.P)
    best = minimize(
        lambda x: (x - free) @ precision @ (x - free), free, jac=lambda x: 2 * precision @ (x - free),
        bounds=[(None, None)] * 3 + [(-2.0, 2.0), (-50.0, 50.0)], method="L-BFGS-B", options={"ftol": 1e-15},
    )  # fmt: skip
    P = belief.P.copy()
    assert StateLimits({3: 2.0, 4: 50.0}).hold(belief)
    np.testing.assert_allclose(belief.x, best.x, atol=1e-4)
    assert abs(belief.x[3]) == 2.0
    np.testing.assert_array_equal(belief.P, P)


def feed(change, late=0, last=10**9, patience=0.5):
    """Feed the record with ``change(t)`` added to the gauge.

    Frames come ``late`` instants after exposure; there are none after instant ``last``.
    """
    estimator = Estimator(
        strip_model(), StripKinematics(), SENSORS, EstimatorConfig(reopen_after=1000, bias_patience=patience)
    )
    estimates = []
    for k, t in enumerate(RECORD.t[: last + 14]):
        now = [s for s in RECORD.samples[k] if s.sensor != "camera"]
        frames = (
            [s for s in RECORD.samples[k - late] if s.sensor == "camera"] if late <= k <= last + late else []
        )
        moved = [Measurement(s.sensor, s.t, s.y + change(s.t) * (s.sensor == "root_strain")) for s in now]
        estimates.append(estimator.step([*moved, *frames], RECORD.tau[k], float(t)))
    return estimates, estimator


def report(estimate):
    return next(r for r in estimate.sensors if r.name == "root_strain")


def test_a_gauge_that_drifts_beyond_its_limit_is_put_out_of_use_and_named():
    estimates, estimator = feed(lambda t: 4e-6 * t)
    b = np.array([e.b[0] for e in estimates])
    assert np.abs(b).max() <= 10e-6
    faulty = [k for k, e in enumerate(estimates) if report(e).status == "faulty"]
    reached = np.flatnonzero(b > 9.5e-6)[0]
    assert 0.5 / DT <= faulty[0] - reached <= 1.0 / DT
    assert report(estimates[-1]).reason == "bias of strain is at its limit, 1e-05 1"
    assert estimates[-1].status == "degraded"
    silent = estimator.figures()["root_strain"]
    assert silent["bias of strain [1]"] == estimates[-1].b[0]
    assert silent["one sigma of it (strain) [1]"] == pytest.approx(np.sqrt(estimates[-1].P[-1, -1]))


def test_a_gauge_that_was_beyond_its_limit_is_used_again_once_its_bridge_was_replaced():
    """It stayed out of use until a reset, whatever its plug did."""
    estimator = Estimator(
        strip_model(), StripKinematics(), SENSORS, EstimatorConfig(reopen_after=1000, bias_patience=0.5)
    )
    out, back = 800, 1100  # instants: 1.5 s without its plug
    said = []
    for k, t in enumerate(RECORD.t):
        zero = 4e-6 * t if k < out else 3e-6
        now = [s for s in RECORD.samples[k] if s.sensor != "root_strain" or not out <= k < back]
        moved = [s._replace(y=s.y + zero) if s.sensor == "root_strain" else s for s in now]
        estimate = estimator.step(moved, RECORD.tau[k], float(t))
        said.append((report(estimate).status, estimate.b[0]))
    assert said[out - 1][0] == "faulty"
    assert {status for status, _ in said[back + 20 :]} == {"ok"}
    assert said[-1][1] == pytest.approx(3e-6, abs=1.5e-6)


def test_the_bias_of_a_sensor_that_speaks_seldom_is_not_forgotten_in_between():
    slow = replace(GAUGE, rate_hz=0.5)
    estimator = Estimator(strip_model(), StripKinematics(), (ENCODER, slow, CAMERA), EstimatorConfig())
    for k, t in enumerate(RECORD.t[:1500]):  # the last sample of the gauge was 1.5 s ago
        said = [s for s in RECORD.samples[k] if s.sensor not in ("root_strain", "tip_accelerometer")]
        said += [s for s in RECORD.samples[k] if s.sensor == "root_strain" and k % 400 == 0]
        estimate = estimator.step(said, RECORD.tau[k], float(t))
    assert estimate.P[-1, -1] < 2.0 * slow.bias.sigma**2  # 2.6 where it was forgotten


def test_at_the_limit_late_frames_lead_to_the_state_of_frames_in_time():
    """What is computed again is held at the limit in every instant, as it was the first time."""
    last = 780  # the last frame; the late ones have all arrived 12 instants later
    (in_time, _), (late, _) = (feed(lambda t: 5e-6 * t, delay, last, 1e3) for delay in (0, 12))
    held = [e.b[0] == 10e-6 for e in in_time[last - 60 : last + 13]]
    assert sum(held) >= 10
    assert not np.array_equal(in_time[last].x, late[last].x)
    np.testing.assert_array_equal(late[last + 12].x, in_time[last + 12].x)
    np.testing.assert_array_equal(late[last + 12].P, in_time[last + 12].P)


def test_a_bias_that_cannot_be_told_is_left_out_and_said_so():
    loose = replace(ENCODER, bias=BiasSpec(1e-3, 0.0, 1e-2))
    estimator = Estimator(strip_model(), StripKinematics(), (loose, STRAIN_GAUGE), EstimatorConfig())
    assert estimator.step([], np.zeros(1), 0.0).layout.biases == ()
    assert estimator.figures()["encoder"] == {"bias of position observable [1]": 0.0}
