"""A rearrangement is told only when the other channels see it, too."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexarm_estimator.isolation.cross_check import is_borne_out
from flexarm_estimator.isolation.hypotheses import FLIPPED, SWAPPED, Rearrangement
from flexarm_estimator.isolation.known_biases import KnownBiases
from flexarm_estimator.isolation.window import Window

K = 60
FLIP = Rearrangement((1,), FLIPPED, np.arange(3), np.array([1.0, -1.0, 1.0]))
SWAP = Rearrangement((0, 2), SWAPPED, np.array([2, 1, 0]), np.ones(3))
SIGMA = np.array([1e-6, 1e-6, 0.02])


def predicted(seed):
    """What the others expect of three channels, each in its own unit."""
    return np.random.default_rng(seed).standard_normal((K, 3)) * [5e-6, 5e-6, 0.3]


def judge(blamed, said, expected, spread=1.0, biases=None):
    window = Window(np.arange(K) * 5e-3, [np.zeros(1)] * K, said, [], np.zeros(1), (), biases)
    run = SimpleNamespace(predicted=expected, variance=np.tile(SIGMA**2, (K, 1)) * spread**2)
    return is_borne_out(blamed, run, window)


@given(seed=st.integers(0, 1000), share=st.floats(0.2, 5.0))
def test_a_flipped_channel_says_the_contrary_of_what_the_others_expect(seed, share):
    z = predicted(seed)
    assert judge(FLIP, z * [1.0, -share, 1.0], z)
    assert not judge(FLIP, z * [1.0, share, 1.0], z)  # an arm that is softer, or heavier


def test_swapped_channels_say_what_the_others_expect_of_each_other():
    z = predicted(1)
    assert judge(SWAP, z[:, [2, 1, 0]], z)
    assert not judge(SWAP, z, z)
    assert not judge(SWAP, -z, z)


def test_what_was_not_said_and_what_was_predicted_before_the_run_had_settled_do_not_count():
    z = predicted(2)
    said = z * [1.0, -1.0, 1.0]
    said[20:50, 1] = np.nan
    early = z.copy()
    early[:12, 1] = -1e3 * z[:12, 1]
    assert judge(FLIP, said, early)


@pytest.mark.parametrize("blamed", [FLIP, SWAP])
def test_channels_that_say_nothing_bear_nothing_out(blamed):
    said = np.full((K, 3), np.nan)
    assert not judge(blamed, said, predicted(3))
    assert not judge(replace(blamed), np.zeros((K, 3)), predicted(3))


def test_others_that_can_hardly_tell_bear_nothing_out():
    """Two axes turn alike, and without their encoders nobody knows where they are: chance would decide."""
    z = predicted(4)
    z[:, 2] = z[:, 0] + 1e-9
    swapped = z[:, [2, 1, 0]]
    assert judge(SWAP, swapped, z, spread=1e-4)
    assert not judge(SWAP, swapped, z)


def test_biases_that_were_learned_go_along_with_what_is_put_right():
    """A flipped gauge of a bridge that is not zeroed: -z + b, where the others expect z + b."""
    z, bias = predicted(5), np.array([40e-6, -30e-6, 0.0])
    known = KnownBiases(bias[:2], np.zeros(2), np.array([0, 1]))
    assert judge(FLIP, z * [1.0, -1.0, 1.0] + bias, z + bias, biases=known)
    assert not judge(FLIP, z + bias, z + bias, biases=known)
    assert not judge(FLIP, z * [1.0, -1.0, 1.0] + bias, z + bias)  # without them 30 sigmas speak against it
