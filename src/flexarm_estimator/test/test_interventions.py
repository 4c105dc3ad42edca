"""What a user does to the estimator: refused by name, done at its stamp, the same when it is done again."""

from dataclasses import replace

import numpy as np
import pytest
from planar_strip import DT, SENSORS, StripKinematics, arriving, simulate, strip_model

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.filter import Belief
from flexarm_estimator.interventions.intervention import InterventionError
from flexarm_estimator.interventions.reset import Reset
from flexarm_estimator.interventions.set_noise import SETTINGS, SetNoise
from flexarm_estimator.interventions.set_state import SetState
from flexarm_estimator.interventions.toggle_sensor import ToggleSensor
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.settings import EstimatorConfig

CONFIG = EstimatorConfig()
RECORD = simulate(300, np.random.default_rng(51), camera_every=7)


def with_limit(sensors):
    return tuple(replace(s, velocity=6.0) if s.kind == "encoder" else s for s in sensors)


def estimator(sensors=SENSORS, config=CONFIG):
    return Estimator(strip_model(), StripKinematics(), sensors, config)


def run(made, first, last):
    for k in range(first, last):
        estimate = made.step(arriving(RECORD, k, 12), RECORD.tau[k], float(RECORD.t[k]))
    return estimate


def do(made, intervention):
    intervention.check(made)
    intervention.apply(made)


@pytest.mark.parametrize(
    ("intervention", "words"),
    [
        (ToggleSensor("gyro", False), "name: no sensor 'gyro'; allowed: encoder, root_strain"),
        (SetNoise("gate", (1.0,)), "name: 'gate' has no noise to set; allowed: encoder, root_strain"),
        (SetNoise("encoder", (1.0, 2.0)), "value: 2 numbers; allowed: 1"),
        (SetNoise("camera", (1.0, 2.0)), "value: 2 numbers; allowed: 1 or 6"),
        (SetNoise("encoder", ()), "value: 0 numbers"),
        (SetNoise("encoder", (0.0,)), "value: 0.0; allowed: from 1e-12 to 1e+06, SI"),
        (SetNoise("encoder", (np.nan,)), "value: nan; allowed: from 1e-12"),
        (
            SetNoise("modal_force", (-1.0,)),
            "value: modal_force: -1.0 is not a finite number in [1e-06, 1000.0]",
        ),
        (SetState((0.1, 0.2)), "theta: 2 numbers; allowed: 1"),
        (SetState((np.inf,)), "theta: inf; allowed: from -1e+06 to 1e+06, SI"),
        (SetState((0.1,), eta=(1.0,)), "eta: 1 numbers; allowed: 0 or 3"),
        (SetState((0.1,), theta_sigma=(-1.0,)), "theta_sigma: -1.0; allowed: from 1e-12"),
        (SetState((0.1,), joint_names=("elbow.rz",)), "joint_names: elbow.rz; allowed: base.rz"),
        (SetState((0.1,), model_id="0123"), "the state belongs to model 0123, the estimator uses"),
        (SetState((360.0,)), "encoder (base.rz) would read 360 rad; it can read -100 to 100 rad"),
        (
            SetState((0.1,), theta_dot=(-13.0,)),
            "theta_dot: base.rz would move at -13 rad/s; allowed: up to 12 rad/s, 2 times its limit",
        ),
        (
            SetState((0.1,), eta_dot=(0.0, -1e6, 0.0)),
            "eta_dot: where mode 2 swings to then root_strain (strip.gauge) would read 659",
        ),
        (SetState((0.1,), eta=(1.0, 0.0, 0.0)), "root_strain (strip.gauge) would read 0.0265; it can read"),
    ],
)
def test_what_cannot_be_done_is_refused_by_field_value_and_what_is_allowed(intervention, words):
    with pytest.raises(InterventionError) as refused:
        intervention.check(estimator(with_limit(SENSORS)))
    assert words in str(refused.value)


def test_a_state_that_a_sound_encoder_denies_is_refused_and_taken_without_it():
    """A controller drove an axis where there was nothing to go to: its place had been set 50 mrad off."""
    made = estimator()
    at = float(run(made, 0, 200).x[0])
    off = SetState((at + 0.05,), theta_sigma=(1e-4,))
    with pytest.raises(
        InterventionError, match=r"theta: base.rz would be at .* its encoder 'encoder' has it at"
    ):
        off.check(made)
    SetState((at + 0.05,), theta_sigma=(0.02,)).check(made)  # not so sure of it
    SetState((at,), theta_sigma=(1e-4,)).check(made)
    do(made, ToggleSensor("encoder", False))
    off.check(made)


def test_an_arm_without_gauges_is_not_bent_to_pieces_either():
    made = estimator(tuple(spec for spec in SENSORS if spec.kind != "strain_gauge"))
    with pytest.raises(InterventionError, match=r"eta: mode 2 at 1e\+06 kg\^0.5 m; allowed: up to"):
        SetState((0.1,), eta=(0.0, 1e6, 0.0)).check(made)
    SetState((0.1,), eta=(1e-3, 0.0, 0.0)).check(made)


@pytest.mark.parametrize("most", [6.0, np.inf])
def test_a_velocity_that_an_axis_can_have_is_taken(most):
    made = estimator(with_limit(SENSORS) if most == 6.0 else SENSORS)  # without a limit there is none here
    do(made, SetState((0.1,), theta_dot=(11.9,), eta_dot=(0.1, 0.1, 0.1)))
    assert made.past[1][-1].belief.x[4] == 11.9


def test_a_sensor_that_is_off_is_as_if_it_were_not_there():
    made, without = estimator(), estimator()
    do(made, ToggleSensor("root_strain", False))
    for k in range(200):
        samples = arriving(RECORD, k, 12)
        off = made.step(samples, RECORD.tau[k], k * DT)
        gone = without.step([s for s in samples if s.sensor != "root_strain"], RECORD.tau[k], k * DT)
        np.testing.assert_array_equal(off.x, gone.x)
    report = next(report for report in off.sensors if report.name == "root_strain")
    assert (report.status, report.accepted) == ("off", 0)
    assert (off.status, off.reason) == ("ok", "")  # it was asked for: nobody waits for it
    do(made, ToggleSensor("root_strain", True))
    estimate = run(made, 200, 220)
    assert next(r for r in estimate.sensors if r.name == "root_strain").accepted == 20


def test_another_noise_from_the_start_is_that_of_an_estimator_made_with_it():
    sensors = tuple(replace(s, sigma=2.0 * s.sigma) if s.name == "camera" else s for s in SENSORS)
    made, fresh = estimator(), estimator(sensors, replace(CONFIG, modal_force=0.5))
    do(made, SetNoise("camera", (1e-3,) * 3 + (1e-2,) * 3))
    do(made, SetNoise("modal_force", (0.5,)))
    one, other = run(made, 0, 200), run(fresh, 0, 200)
    np.testing.assert_allclose(one.x, other.x, rtol=1e-9, atol=1e-12)
    assert abs(run(estimator(), 0, 200).x - one.x).max() > 1e-9


@pytest.mark.parametrize(
    ("name", "step"), [("encoder", 1e-3), ("encoder", 3e-3), ("root_strain", 1e-5), ("root_strain", 5e-5)]
)
def test_a_coarse_sensor_whose_noise_is_set_is_not_called_frozen(name, step):
    """The watches judged by the noise of the description: a sound encoder was put out of use."""
    sigma = step / np.sqrt(12.0)
    specs = tuple(replace(spec, sigma=np.array([sigma])) if spec.name == name else spec for spec in SENSORS)
    told, made = estimator(), estimator(specs)
    do(told, SetNoise(name, (sigma,)))
    for k, t in enumerate(RECORD.t):
        samples = [
            sample._replace(y=np.round(sample.y / step) * step) if sample.sensor == name else sample
            for sample in RECORD.samples[k]
        ]
        found, expected = (each.step(samples, RECORD.tau[k], float(t)) for each in (told, made))
        assert [report[:6] for report in found.sensors] == [report[:6] for report in expected.sensors]
        np.testing.assert_array_equal(found.x, expected.x)
    assert found.status == "ok"


def test_noise_set_in_a_run_takes_effect_without_a_jump():
    made = estimator()
    before = run(made, 0, 200)
    do(made, SetNoise("encoder", (5e-3,)))
    after = run(made, 200, 201)
    assert abs(after.theta[0] - before.theta[0] - before.theta_dot[0] * DT) < 1e-3
    later = run(made, 201, 300)
    assert later.P[0, 0] > 4.0 * before.P[0, 0]


@pytest.mark.parametrize("name", SETTINGS)
def test_every_setting_offered_is_one_of_the_estimator(name):
    do(estimator(), SetNoise(name, (0.01,)))


def test_a_state_is_set_with_its_sigma_and_what_is_left_out_is_zero_or_as_at_the_start():
    made = estimator()
    at = float(run(made, 0, 100).theta[0])
    start = made.past[0].process.P0
    state = SetState((at,), theta_dot=(0.5,), eta=(1e-3, 0.0, 0.0), theta_sigma=(1e-3,), eta_sigma=(2e-4,))
    do(made, state)
    belief = made.past[1][-1].belief
    np.testing.assert_array_equal(belief.x[:9], [at, 1e-3, 0, 0, 0.5, 0, 0, 0, 0])
    sigma = np.sqrt(belief.P.diagonal())
    np.testing.assert_allclose(sigma[:4], [1e-3, 2e-4, 2e-4, 2e-4])
    np.testing.assert_allclose(sigma[4:9] ** 2, start.diagonal()[4:9])
    estimate = made.step([], np.zeros(1), 100 * DT)
    assert estimate.theta[0] == pytest.approx(at + 0.5 * DT, abs=1e-4)
    assert estimate.status == "ok"


def test_the_order_of_the_names_is_that_of_the_numbers():
    state = SetState((0.25,), joint_names=("base.rz",))
    made = estimator()
    run(made, 0, 10)
    do(made, state)
    assert made.past[1][-1].belief.x[0] == 0.25


def test_a_state_set_after_a_reset_is_kept():
    made = estimator()
    at = float(run(made, 0, 50).theta[0]) + 5e-5  # rad; 2.5 sigmas of the encoder
    do(made, Reset())
    do(made, SetState((at,), theta_sigma=(1e-6,)))
    estimate = made.step([], np.zeros(1), 50 * DT)
    assert estimate.theta[0] == pytest.approx(at, abs=1e-8)


@pytest.mark.parametrize("turns", [1, 100_000])
def test_a_state_that_cannot_be_is_left(turns):
    """A camera sees no turns: it and the gauge agreed on turns too many, and the encoder was out of use.

    Nothing led back from there, nor did a reset, which starts anew where the axes are said to be.
    """
    limited = tuple(replace(s, low=-3.5, high=3.5) if s.name == "encoder" else s for s in SENSORS)
    made, away = estimator(limited), np.zeros(9)
    run(made, 0, 100)
    away[0] = 2.0 * np.pi * turns
    for until in (200, 300):
        made.set_belief(Belief(made.past[1][-1].belief.x + away, 1e-6 * np.eye(9)))
        estimate = run(made, until - 100, until)
        assert estimate.status in ("ok", "degraded")
        assert estimate.theta[0] == pytest.approx(RECORD.x[until - 1, 0], abs=1e-3)
    made.set_belief(Belief(made.past[1][-1].belief.x + away, 1e-6 * np.eye(9)))
    do(made, Reset())
    assert run(made, 300, 301).theta[0] == pytest.approx(RECORD.x[300, 0], abs=1e-3)


@pytest.mark.parametrize("steps", [0, 50])
def test_a_state_set_before_the_first_step_begins_it_with_its_sigmas_and_velocities(steps):
    """It was begun anew where the axes were said to be, still and as if little were known."""
    made, running, t = estimator(), estimator(), 1000.0
    for k in range(steps):
        made.step([], np.zeros(1), t - 1.0 + k * DT)
    do(made, Reset())
    running.step([], np.zeros(1), t - DT)
    for each in (made, running):
        do(each, SetState((0.7,), (0.2,), (0.0, 0.01, 0.0), theta_sigma=(1e-6,), eta_sigma=(1e-5,)))
    found, expected = (each.step([], np.zeros(1), t) for each in (made, running))
    np.testing.assert_allclose(found.x, expected.x, rtol=1e-6)
    np.testing.assert_allclose(found.P.diagonal(), expected.P.diagonal(), rtol=1e-6)
    assert made.step([], np.zeros(1), t + 5.0).theta_dot[0] == 0.0  # a gap later is one as ever


@pytest.mark.parametrize("is_reset_first", [True, False])
def test_a_reset_beside_a_switched_channel_forgets_the_state(is_reset_first):
    """Both before the next step: the state that had been forgotten was taken up again."""
    made = estimator()
    run(made, 0, 200)
    asked = [Reset(), ToggleSensor("camera", False, ("rx", "ry", "rz"))]
    for each in asked if is_reset_first else reversed(asked):
        do(made, each)
    estimate = made.step([], RECORD.tau[200], float(RECORD.t[200]))
    assert estimate.status == "starting"
    assert estimate.P[0, 0] > 0.1


def test_a_state_that_was_set_before_the_first_step_survives_a_switched_channel():
    made = estimator()
    do(made, SetState((0.3,)))
    do(made, ToggleSensor("camera", False, ("rx", "ry", "rz")))
    assert made.step([], RECORD.tau[0], 0.0).x[0] == pytest.approx(0.3, abs=1e-3)


def test_what_is_no_array_of_numbers_is_refused_with_and_without_a_channel_switched_off():
    ragged = [[1.0], [1.0, 2.0]]
    made = estimator()
    for k in range(6):
        if k == 3:
            do(made, ToggleSensor("camera", False, ("rx", "ry", "rz")))
        t = k * DT
        made.step(
            [Measurement("camera", t, ragged), Measurement("encoder", t, np.zeros(1), ragged)], ragged, t
        )
    camera = next(report for report in made.step([], [0.0], 6 * DT).sensors if report.name == "camera")
    assert camera.accepted == 0 and camera.rejected == 6
