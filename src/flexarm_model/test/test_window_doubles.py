"""Behind a window a resonance is one mode, and two of shapes of their own stay two."""

from __future__ import annotations

import numpy as np
import pytest

from flexarm_model.identification.automatic import identify_modes
from flexarm_model.identification.doubles import main_lobe
from flexarm_model.identification.spectra import SpectrumSettings, block_spectra
from flexarm_model.modal.frf import Frf

RATE, SECONDS = 256.0, 40.0
SHAPES = np.array([[1.0, 0.7, -0.6, 0.2], [1.0, -0.4, 0.9, -1.0]])
LINES_HZ = 0.25  # four of them are as wide as Hann's main lobe


def behind_hann(f_hz: np.ndarray, zeta: np.ndarray, shapes: np.ndarray, seed: int) -> Frf:
    """Return accelerances of modes from noise behind a Hann window, 2 % noise on the outputs."""
    rng = np.random.default_rng(seed)
    samples = round(RATE * SECONDS)
    x = rng.standard_normal(4 * samples)
    lines = np.fft.rfftfreq(x.size, 1 / RATE)
    w, w_n = 2 * np.pi * lines[:, None], 2 * np.pi * f_hz
    H = (-(w**2) / (w_n**2 - w**2 + 2j * zeta * w_n * w)) @ (shapes * shapes[:, :1])
    H[lines > 0.4 * RATE] = 0.0
    y = np.fft.irfft(H * np.fft.rfft(x)[:, None], x.size, axis=0)[-samples:]
    y += 0.02 * y.std(axis=0) * rng.standard_normal(y.shape)
    settings = SpectrumSettings(round(RATE / LINES_HZ))
    return block_spectra([x[-samples:, None]], [y], RATE, settings).frf("H1", "accelerance").frf.band(5, 60)


@pytest.mark.parametrize("seed", range(4))
def test_a_resonance_narrower_than_the_main_lobe_is_one_mode(seed: int) -> None:
    """Two modes of one shape, 1.3 lines apart, stood in the place of each, right in none of their numbers."""
    truth = np.array([15.0, 44.0])
    frf = behind_hann(truth, np.array([0.01, 0.008]), SHAPES, seed)
    fit = identify_modes(frf, lobe_lines=main_lobe("hann")).fit
    assert fit is not None
    assert fit.model.f_hz == pytest.approx(truth, abs=0.05)


@pytest.mark.parametrize("seed", range(3))
def test_two_modes_of_shapes_of_their_own_stay_two_within_the_main_lobe(seed: int) -> None:
    truth = np.array([28.0, 28.4])
    frf = behind_hann(truth, np.array([0.01, 0.01]), SHAPES, seed)
    fit = identify_modes(frf, lobe_lines=main_lobe("hann")).fit
    assert fit is not None
    assert fit.model.f_hz == pytest.approx(truth, abs=0.1)


def test_the_main_lobe_of_a_window_is_known() -> None:
    """Their textbooks' numbers, from zero to zero."""
    names = {"boxcar": 2.0, "hann": 4.0, "hamming": 4.0, "blackman": 6.0, "flattop": 10.0}
    assert {name: main_lobe(name) for name in names} == pytest.approx(names, abs=0.1)
