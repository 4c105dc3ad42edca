"""Root mean squares in bands: known sines, Parseval, and densities integrated by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from flexarm_model.modal.bands import band_rms, density_band_rms

RATE = 200.0


def test_sines_show_in_their_bands_with_amplitude_over_root_two() -> None:
    t = np.arange(400) / RATE
    y = np.column_stack([3 * np.sin(2 * np.pi * 5 * t) + np.cos(2 * np.pi * 30 * t), np.full(t.size, 2.0)])
    found = band_rms(y, RATE, np.array([0.0, 1.0, 10.0, 100.0]))
    expected = [[0.0, 2.0], [3 / np.sqrt(2), 0.0], [1 / np.sqrt(2), 0.0]]
    assert found == pytest.approx(np.array(expected), abs=1e-12)


@settings(deadline=None, derandomize=True, max_examples=60)
@given(st.integers(1, 40).flatmap(lambda k: arrays(float, (k, 2), elements=st.floats(-1e3, 1e3))))
def test_bands_that_share_no_line_add_up_to_the_record(y: np.ndarray) -> None:
    found = band_rms(y, RATE, np.array([0.0, 7.0, 50.0, 50.5, 100.0]))
    assert np.sum(found**2, axis=0) == pytest.approx(np.mean(y**2, axis=0), rel=1e-9, abs=1e-9)


def test_a_density_is_integrated_between_its_lines() -> None:
    f, density = np.array([0.0, 10.0, 20.0]), np.array([[1.0, 0.0], [1.0, 2.0], [1.0, 0.0]])
    found = density_band_rms(f, density, np.array([2.5, 10.0, 15.0]))
    assert found**2 == pytest.approx(np.array([[7.5, 9.375], [5.0, 7.5]]))


def test_white_noise_has_the_same_density_everywhere() -> None:
    y = np.random.default_rng(0).standard_normal((20000, 1))
    found = band_rms(y, RATE, np.array([0.0, 25.0, 50.0, 75.0, 100.0]))
    assert found == pytest.approx(np.full((4, 1), 0.5), rel=0.05)


def test_bands_outside_the_spectrum_and_bad_records_are_refused() -> None:
    y = np.ones((10, 1))
    for edges in ([0.0, 101.0], [-1.0, 5.0], [5.0, 5.0], [5.0]):
        with pytest.raises(ValueError, match="must ascend within 0.0 .. 100.0 Hz"):
            band_rms(y, RATE, np.array(edges))
    for bad in (np.full((10, 1), np.nan), np.ones(10), np.ones((0, 1))):
        with pytest.raises(ValueError, match="need finite records"):
            band_rms(bad, RATE, np.array([0.0, 5.0]))
    with pytest.raises(ValueError, match="negative or not finite"):
        density_band_rms(np.array([0.0, 1.0]), -y[:2], np.array([0.0, 1.0]))
