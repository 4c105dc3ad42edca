"""What one sensor does by itself: values that repeat, lone jumps, shifts, and the mean of its innovations."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexarm_estimator.judging.repeats import FROZEN, SAME, STUCK
from flexarm_estimator.judging.short_term import HELD, SHIFT, ShortTerm
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.watches.mean_shift import MeanTest

DT = 0.005
SIGMA = 0.1


class Sensor:
    """One channel whose prediction is given; ``S`` is twice the noise."""

    def __init__(self):
        self.past, self.k = ShortTerm([SIGMA], 5.0), 0

    def say(self, y, predicted):
        """Return the doubt, the samples that are let go, and those that are dropped."""
        self.k += 1
        sample = Measurement("a", self.k * DT, np.array([y]))
        nu = np.array([y - predicted])
        z = abs(nu[0]) / (2 * SIGMA)
        run = self.past.meet(sample)
        doubt = self.past.doubt(run, nu, z)
        released, dropped = self.past.note(run, sample, nu, z, doubt, not doubt)
        return doubt, [s.t for s in released], [s.t for s in dropped]


def used(samples=200, seed=1):
    """Return a sensor that has worked for a while."""
    sensor, rng = Sensor(), np.random.default_rng(seed)
    for noise in SIGMA * rng.standard_normal(samples):
        assert sensor.say(noise, 0.0)[0] == ""
    return sensor


def test_a_value_that_repeats_while_the_prediction_moves_on_is_frozen_at_once():
    sensor = used()
    sensor.say(0.01, 0.0)
    assert sensor.say(0.01, 0.6)[0] == FROZEN


def test_a_value_that_has_never_repeated_before_is_not_believed_for_ten_samples():
    """The arm has only moved yet: whether the sensor has noise when it rests nobody knows."""
    sensor, rng = Sensor(), np.random.default_rng(1)
    for k, noise in enumerate(SIGMA * rng.standard_normal(200)):
        assert sensor.say(noise + SIGMA * k, SIGMA * k)[0] == ""
    doubts = [sensor.say(200 * SIGMA + 0.01, 200 * SIGMA)[0] for _ in range(14)]
    assert doubts == [""] + 10 * [SAME] + 3 * [""]


def test_a_value_that_never_repeated_at_rest_is_not_believed_at_all_until_it_changes():
    sensor = used()
    doubts = [sensor.say(0.01, 0.0)[0] for _ in range(40)]
    assert doubts == [""] + 4 * [SAME] + 35 * [STUCK]
    assert sensor.say(0.02, 0.0)[0] == ""
    assert [sensor.say(0.01, 0.0)[0] for _ in range(7)] == [""] + 4 * [SAME] + 2 * [STUCK]


def test_a_sensor_that_froze_before_its_noise_was_known_is_known_later():
    sensor, rng = used(30), np.random.default_rng(2)
    assert sensor.say(0.01, 0.0)[0] == "" and SAME in {sensor.say(0.01, 0.0)[0] for _ in range(20)}
    assert sensor.say(0.01, 0.0)[0] == ""
    for noise in SIGMA * rng.standard_normal(300):
        assert sensor.say(noise, 0.0)[0] == ""
    assert [sensor.say(0.01, 0.0)[0] for _ in range(7)] == [""] + 4 * [SAME] + 2 * [STUCK]


def test_a_few_equal_values_are_no_rest():
    sensor = used()
    assert [sensor.say(0.01, 0.0)[0] for _ in range(4)] == [""] + 3 * [SAME]
    assert sensor.say(0.02, 0.0)[0] == ""
    assert [sensor.say(0.01, 0.0)[0] for _ in range(7)] == [""] + 4 * [SAME] + 2 * [STUCK]


def test_a_slow_motion_finds_a_value_that_never_repeated_before_within_ten_samples():
    sensor = used()
    doubts = [sensor.say(0.01, 0.4 * SIGMA * k)[0] for k in range(11)]
    assert FROZEN in doubts
    assert not any(doubt == "" for doubt in doubts[1:])


def test_a_quantised_sensor_may_repeat_as_long_as_the_motion_is_less_than_a_step():
    """Noise of a step q is q / sqrt(12); the true position goes on by less than q while the value stays."""
    step, doubts = math.sqrt(12) * SIGMA, []
    sensor = Sensor()
    for k in range(400):
        position = 0.05 * step * k if k < 200 else 10.0 * step
        doubts.append(sensor.say(step * round(position / step), position)[0])
    assert set(doubts) == {""}


@given(
    st.floats(0.001, 4.0), st.floats(0.0, 1.0), st.floats(0.0, 0.2), st.floats(0.0, 0.2), st.integers(0, 99)
)
def test_a_quantised_sensor_is_never_stuck(step, at, speed, noise, seed):
    """Its steps are fine or coarse; it creeps, flickers between two steps or stands before it rests."""
    rng, sensor = np.random.default_rng(seed), Sensor()
    path = [at + speed * step * min(k, 300) for k in range(500)]
    flicker = [noise * rng.standard_normal() if 300 < k < 400 else 0.0 for k in range(500)]
    said = [
        sensor.say(SIGMA * step * round((x + n * step) / step), SIGMA * x)[0]
        for x, n in zip(path, flicker, strict=True)
    ]
    assert STUCK not in said


def test_a_lone_jump_is_held_and_dropped_when_the_next_sample_does_not_show_it():
    sensor = used()
    doubt, released, dropped = sensor.say(2.0, 0.0)
    assert (doubt, released, dropped) == (HELD, [], [])
    assert sensor.say(0.02, 0.0) == ("", [], [201 * DT])


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("sizes", [(2.0, 4.0, 6.0), (1.49, 1.69, 2.57)])  # the second of a payload
def test_a_jump_that_goes_on_growing_is_let_go_in_order_of_time(sizes, way):
    sensor = used()
    doubts = [sensor.say(way * size, 0.0) for size in sizes]
    assert [doubt for doubt, _, _ in doubts] == [HELD, HELD, ""]
    assert doubts[-1][1] == pytest.approx([201 * DT, 202 * DT])


def test_what_is_held_is_judged_by_the_jump_that_came_first():
    """The third sample shows half of the first one: the jump lasts, whatever the second one said."""
    sensor = used()
    results = [sensor.say(size, 0.0) for size in (2.0, 7.0, 1.5)]
    assert [doubt for doubt, _, _ in results] == [HELD, HELD, ""]
    assert results[-1][1:] == (pytest.approx([201 * DT, 202 * DT]), [])


@pytest.mark.parametrize("sizes", [(2.0, 2.1, 1.9), (-2.0, -1.9, -2.1), (2.0, 2.6, 2.2)])
def test_three_samples_off_by_the_same_are_a_shift_and_none_of_them_is_let_go(sizes):
    sensor = used()
    results = [sensor.say(size, 0.0) for size in sizes]
    assert [doubt for doubt, _, _ in results] == [HELD, HELD, SHIFT]
    assert results[-1][1] == []
    assert len(results[-1][2]) == 2


def test_what_grows_little_by_little_is_no_jump():
    sensor = used()
    assert {sensor.say(0.1 * 1.3**k, 0.0)[0] for k in range(14)} == {""}


def test_white_innovations_have_a_score_of_about_one_and_a_bias_of_three_sigmas_is_seen_in_eight():
    """The mean's variance is a / (2 - a) of the innovations' [AR(1) of white noise]."""
    test, rng = MeanTest([SIGMA]), np.random.default_rng(2)
    scores = []
    for k, noise in enumerate(3.0 * SIGMA * rng.standard_normal(3000)):
        test.add(k * DT, [float(noise)], [float(noise)])
        scores.append(test.score)
    assert np.sqrt(np.mean(np.square(scores[100:]))) == pytest.approx(1.0, abs=0.15)
    assert max(scores) < 5.0
    for k in range(8):
        test.add((3000 + k) * DT, [9.0 * SIGMA], [9.0 * SIGMA])
    assert test.score > 5.0
    assert test.onset == pytest.approx(3000 * DT, abs=3 * DT)


def test_rounding_errors_have_no_mean():
    test = MeanTest([SIGMA])
    for k in range(200):
        test.add(k * DT, [1e-12], [1e-12])
    assert test.score < 1e-9


def test_innovations_that_swing_ten_times_in_their_memory_have_no_mean():
    test = MeanTest([SIGMA])
    for k in range(500):
        value = SIGMA * math.sin(2 * math.pi * k / 8)
        test.add(k * DT, [value], [0.0])
    assert test.score < 3.0


@pytest.mark.parametrize(("swing", "is_bias"), [(0.0, True), (20.0, False)])
def test_a_mean_that_comes_with_a_swing_of_the_prediction_is_the_models(swing, is_bias):
    test, rng = MeanTest([SIGMA]), np.random.default_rng(3)
    for k in range(300):
        noise = float(SIGMA * rng.standard_normal())
        test.add(k * DT, [noise], [noise])
    for k in range(7):
        test.add((300 + k) * DT, [3.0 * SIGMA], [3.0 * SIGMA + swing * SIGMA * k / 7])
    assert test.score > 4.0
    assert test.is_sudden([3.0 * SIGMA]) == is_bias


def test_a_mean_that_builds_up_slowly_is_not_sudden():
    test, rng = MeanTest([SIGMA]), np.random.default_rng(4)
    for k in range(300):
        noise = float(SIGMA * rng.standard_normal())
        test.add(k * DT, [noise], [noise])
    for k in range(20):
        test.add((300 + k) * DT, [0.2 * k * SIGMA], [0.0])
    assert not test.is_sudden([4.0 * SIGMA])
