"""Bootstrap over averages: its sigma is the scatter of repeated measurements."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from flexarm_model.identification.bootstrap import bootstrap
from flexarm_model.identification.spectra import BlockSpectra, SpectrumSettings, block_spectra
from flexarm_model.modal.fit import PoleFit, fit_poles
from flexarm_model.modal.modes import poles_of

RATE, BLOCK, BAND = 200.0, 1024, (14.0, 26.0)
TRUE = poles_of(np.array([20.0]), np.array([0.02]))


def measurement(seed: int) -> tuple[BlockSpectra, PoleFit]:
    rng, omega = np.random.default_rng(seed), 2 * np.pi * 20.0
    b, a, _ = signal.cont2discrete(([1.0], [1.0, 0.04 * omega, omega**2]), 1 / RATE, method="zoh")
    x = rng.standard_normal(16 * BLOCK)
    y = signal.lfilter(b.ravel(), a, x)
    y += 0.5 * y.std() * rng.standard_normal(y.size)
    blocks = block_spectra([x[:, None]], [y[:, None]], RATE, SpectrumSettings(BLOCK, overlap=0.0))
    return blocks, fit_poles(blocks.frf("H1", "receptance").frf.band(*BAND), TRUE)


def test_its_sigma_is_the_scatter_of_repeated_measurements() -> None:
    runs = [measurement(seed) for seed in range(20)]
    scatter = np.std([fit.model.f_hz[0] for _, fit in runs], ddof=1)
    stated = np.median([bootstrap(*run, "H1", BAND, draws=10).f_std_hz[0] for run in runs[:4]])
    assert stated == pytest.approx(scatter, rel=0.5)  # 20 runs know a scatter to 16 %, 40 draws to 12 %


def test_two_blocks_tell_nothing() -> None:
    blocks, fit = measurement(0)
    with pytest.raises(ValueError, match="3 are needed"):
        bootstrap(BlockSpectra(blocks.f_hz, blocks.spectra[:2], 1), fit, "H1", BAND)
