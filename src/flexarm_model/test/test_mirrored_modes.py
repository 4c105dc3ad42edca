"""Which poles are modes above half the rate: sampling as it is, and what a description may be off by."""

from __future__ import annotations

import numpy as np
import pytest

from flexarm_model.identification.mirrored_modes import ToldModes, find_mirrored, mirror

RATE = 200.0
DESCRIBED = (4.0, 37.0, 235.0)  # the last shows at 35 Hz
DAMPING = 0.005


def told(f_hz: tuple[float, ...], zeta: tuple[float, ...] = (), shapes: object = None) -> ToldModes:
    """Return modes, without shapes unless there are some."""
    seen = np.zeros((len(f_hz), 0)) if shapes is None else np.array(shapes)
    return ToldModes(np.array(f_hz), np.array(zeta or (DAMPING,) * len(f_hz)), seen)


@pytest.mark.parametrize("f_hz", [35.0, 95.0, 100.0, 165.0, 235.0, 365.0, 1001.0])
def test_samples_of_a_fast_mode_are_those_of_the_one_that_mirrors_it(f_hz: float) -> None:
    t = np.arange(50) / RATE
    seen = float(mirror(np.array([f_hz]), RATE)[0])
    assert seen <= RATE / 2
    assert np.cos(2 * np.pi * seen * t) == pytest.approx(np.cos(2 * np.pi * f_hz * t), abs=1e-9)


@pytest.mark.parametrize("scale", [0.87, 0.95, 0.99, 1.0, 1.01, 1.03])
def test_an_arm_that_is_off_alike_in_all_modes_is_told_apart_from_its_mirror_images(scale: float) -> None:
    """The mirror image moves by six times as much as the mode beside which it shows, and passes it."""
    f = scale * np.array(DESCRIBED)
    seen = mirror(f, RATE)
    found = told(tuple(seen), (DAMPING, DAMPING, DAMPING * f[2] / seen[2]))
    assert find_mirrored(found, told(DESCRIBED), RATE).tolist() == [-1, -1, 2]


@pytest.mark.parametrize("scale", [0.87, 0.93, 1.0, 1.04, 1.1])
def test_modes_of_the_band_are_themselves_where_no_image_is_seen(scale: float) -> None:
    found = told((4.0 * scale, 37.0 * scale))
    assert find_mirrored(found, told(DESCRIBED), RATE).tolist() == [-1, -1]


def test_a_mode_that_is_off_alone_is_known_by_its_decay_and_its_shape() -> None:
    """It lies where the fast one shows, but rings as long, and moves the sensors, as the slow one does."""
    shapes = [[1.0, 0.0], [0.6, 0.8], [0.8, -0.6]]
    found = told((4.0, 35.0), shapes=shapes[:2])
    assert find_mirrored(found, told(DESCRIBED, shapes=shapes), RATE).tolist() == [-1, -1]
    image = told((4.0, 35.0), (DAMPING, DAMPING * 235 / 35), [shapes[0], shapes[2]])
    assert find_mirrored(image, told(DESCRIBED, shapes=shapes), RATE).tolist() == [-1, 2]


def test_a_pole_that_no_described_mode_explains_is_left_alone() -> None:
    found = told((4.0, 20.0, 37.0), (DAMPING, 1e-4, DAMPING))
    assert find_mirrored(found, told(DESCRIBED), RATE).tolist() == [-1, -1, -1]
