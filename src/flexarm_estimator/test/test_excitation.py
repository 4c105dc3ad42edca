"""The window in which the arm moved most is found; rest and even motion are no reason to look."""

import numpy as np
from planar_strip import SENSORS

from flexarm_estimator.isolation.channels import Channels
from flexarm_estimator.isolation.excitation import Excitation
from flexarm_estimator.measurement import Measurement

CHANNELS = Channels(SENSORS, ["encoder", "root_strain", "tip_accelerometer"])
LENGTH = 60  # ticks


def watched(said):
    """Return what has seen ``said`` (k, 3) in sigmas, and that the camera spoke, too."""
    seen = Excitation(CHANNELS, LENGTH)
    for k, row in enumerate(said):
        samples = [
            Measurement(name, 0.005 * k, row[i : i + 1] * CHANNELS.sigma[i])
            for i, name in enumerate(CHANNELS.spans)
        ]
        seen.tick([*samples, Measurement("camera", 0.005 * k, np.zeros(6))])
    return seen


def test_noise_offsets_and_even_motion_are_rest():
    rng = np.random.default_rng(31)
    for _ in range(20):
        noise = rng.normal(size=(200, 3))
        offset, rate = 1e5 * rng.normal(size=3), 1e3 * rng.normal(size=3)
        assert watched(noise + offset + rate * np.arange(200)[:, None]).find(200) is None


def test_the_window_in_which_most_channels_move_is_found_though_it_is_past():
    said = np.random.default_rng(32).normal(size=(173, 3))
    said[:, 0] += 1e4 * np.sin(0.1 * np.arange(173))  # a fine one moves all the time
    said[90:110] += 200.0 * np.sin(0.4 * np.arange(20))[:, None]
    ago = watched(said).find(173)
    assert ago is not None
    assert 110 - 15 <= 173 - ago <= 90 + LENGTH + 15
    assert (173 - ago) % 15 == 0  # where it looked


def test_windows_that_ended_before_are_not_found_again():
    said = np.random.default_rng(33).normal(size=(180, 3))
    said[60:80] += 200.0 * np.sin(0.4 * np.arange(20))[:, None]
    seen = watched(said)
    assert seen.find(180) is not None
    assert seen.find(30) is None
    assert seen.find(0) is None


def test_a_sensor_that_says_nothing_is_no_motion():
    seen = Excitation(CHANNELS, LENGTH)
    for _ in range(200):
        seen.tick([])
    assert seen.find(200) is None
