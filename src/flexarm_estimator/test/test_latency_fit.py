"""The delay of a camera's stamps from residuals: right, with the scatter that it claims, or not told."""

import numpy as np
import pytest

from flexarm_estimator.watches.latency_fit import LatencyFit

CANDIDATES = np.linspace(-0.02, 0.2, 45)
SIGMA = 0.5e-3  # m, of a frame
OFFSET = np.array([0.02, -0.01, 0.005])  # m; the camera stands somewhere else than it says


def move(t, f_hz=0.4):
    """Rest-to-rest moves and a little vibration of the tip [m]."""
    phase = 2 * np.pi * f_hz * t
    return np.column_stack([0.1 * np.sin(phase), 0.2 * np.cos(0.7 * phase), 0.003 * np.sin(31.0 * t)])


def velocity(t, h=1e-5):
    return (move(t + h) - move(t - h)) / (2 * h)


def fit(delay, seed, frames=600, motion=move, memory=1e9, drift=0.0):
    rng = np.random.default_rng(seed)
    made = LatencyFit(CANDIDATES, memory)
    for k in range(frames):
        stamp = k / 30.0
        y = motion(np.array([stamp - delay - drift * k]))[0] + OFFSET + SIGMA * rng.normal(size=3)
        made.add(y - motion(stamp - CANDIDATES), 1.0 / 30.0)
    return made.result()


@pytest.mark.parametrize("delay", [0.0, 0.0312, 0.06, 0.1])
def test_the_delay_is_found_between_the_candidates_and_an_offset_of_the_camera_drops_out(delay):
    found = fit(delay, 1)
    assert found.value == pytest.approx(delay, abs=4 * found.sigma)
    assert found.sigma < 0.3e-3


def test_sigma_is_that_of_linear_least_squares_and_of_the_scatter_over_seeds():
    t = np.arange(600) / 30.0 - 0.0312
    v = velocity(t) - velocity(t).mean(axis=0)
    expected = SIGMA / np.sqrt((v**2).sum())  # closed form for residuals noise + v (tau - tau0)
    found = [fit(0.0312, seed) for seed in range(2, 18)]
    scatter = np.std([one.value - 0.0312 for one in found])
    assert np.mean([one.sigma for one in found]) == pytest.approx(expected, rel=0.1)  # J bends over 5 ms
    assert 0.5 * expected < scatter < 1.6 * expected  # 16 seeds: chi within +-0.4 at 99 %


def test_an_arm_at_rest_tells_nothing():
    assert fit(0.06, 1, motion=lambda t: np.zeros((t.size, 3))) is None


def at_rest(seed, predicted, frames=800):
    """Return the fit of frames of 50 um beside predictions that scatter by so much in one direction [m]."""
    rng, made = np.random.default_rng(seed), LatencyFit(CANDIDATES, 1e9)
    noise = np.zeros((frames + CANDIDATES.size, 3))
    noise[:, 1] = predicted * rng.normal(size=len(noise))
    for k in range(frames):
        y = 5e-5 * rng.normal(size=3)
        made.add(y - noise[k : k + CANDIDATES.size][::-1], 0.01)
    return made


def test_the_noise_of_the_prediction_is_no_motion():
    """A tracker as good as the encoder: what its frames and the predictions have in common is chance."""
    fits = [at_rest(seed, 6e-5) for seed in range(40)]
    assert any(made.result() is not None for made in fits)
    assert all(made.result(noise=6e-5**2) is None for made in fits)


def test_too_few_frames_tell_nothing():
    assert fit(0.06, 1, frames=20) is None


def test_a_motion_that_repeats_within_the_candidates_is_ambiguous():
    assert fit(0.06, 1, motion=lambda t: 0.05 * np.sin(2 * np.pi * 12.5 * t)[:, None] * np.ones(3)) is None


def test_a_delay_beyond_the_candidates_is_not_told():
    assert fit(0.35, 1) is None


def test_old_frames_are_forgotten():
    slow, fast = (fit(0.03, 1, frames=900, memory=memory, drift=8e-6) for memory in (1e9, 3.0))
    now = 0.03 + 8e-6 * 899
    assert abs(fast.value - now) < 0.0015 < abs(slow.value - now)


def step_fit(seed, before, after, last, first=450):
    """Frames of one delay, then ``last`` frames of another; the fit is asked four times a second."""
    rng, made = np.random.default_rng(seed), LatencyFit(CANDIDATES, 20.0)
    for k in range(first + last):
        stamp, delay = k / 30.0, before if k < first else after
        y = move(np.array([stamp - delay]))[0] + OFFSET + SIGMA * rng.normal(size=3)
        made.add(y - move(stamp - CANDIDATES), 1.0 / 30.0)
        if k % 8 == 0:
            made.drop_what_was_before_a_change()
    return made


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("after", [0.036, 0.04, 0.08, 0.02])
def test_frames_of_before_a_change_do_not_count_2_s_after_it(after, seed):
    found = step_fit(seed, 0.03, after, last=60).result()
    assert abs(found.value - after) < max(3.0 * found.sigma, 1e-3)
    assert found.sigma < 1e-3


@pytest.mark.parametrize("seed", range(20))
def test_what_does_not_change_is_not_forgotten(seed):
    made = step_fit(seed, 0.03, 0.03, last=450)
    in_30_s = 20.0 * (1.0 - np.exp(-1.5)) * 30.0  # frames that weigh exp(-t / 20 s)
    assert made.blocks.weights.sum() == pytest.approx(in_30_s, rel=0.02)


def test_a_misfit_that_is_alike_in_many_frames_is_in_sigma():
    """Such as what a model gets wrong: an error of 1 mm that lasts for a second, of 24 draws."""
    off, told = [], []
    for seed in range(24):
        rng, made = np.random.default_rng(seed), LatencyFit(CANDIDATES, 1e9)
        steps = 1e-3 * rng.normal(size=(30, 3))
        for k in range(900):
            stamp = k / 30.0
            y = move(np.array([stamp - 0.06]))[0] + steps[k // 30]
            made.add(y - move(stamp - CANDIDATES), 1.0 / 30.0)
        off.append(made.result().value - 0.06)
        told.append(made.result().sigma)
    scatter = float(np.sqrt(np.mean(np.square(off))))
    assert 0.5 < scatter / np.mean(told) < 2.0  # white residuals would make it 5


@pytest.mark.parametrize("seed", range(5))
def test_a_delay_that_grows_all_the_time_is_told_of_the_last_seconds(seed):
    """By 2 ms in a second: over all 20 s it would be 0.05 s, known to 3 ms."""
    found = fit(0.03, seed, drift=2e-3 / 30.0)
    assert abs(found.value - (0.03 + 2e-3 * 20.0)) < 0.01
    assert found.sigma < 2e-3


def test_frames_of_long_ago_do_no_harm():
    made = step_fit(1, 0.03, 0.03, last=60)
    for _ in range(3):
        made.add(np.zeros((45, 3)), 1e4)
        made.drop_what_was_before_a_change()
    assert made.result() is None
