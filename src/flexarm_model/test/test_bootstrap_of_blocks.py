"""Bootstrap over averages: its sigma is the scatter of repeated measurements."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy import signal

from flexarm_model.identification.bootstrap import bootstrap
from flexarm_model.identification.spectra import BlockSpectra, SpectrumSettings, block_spectra
from flexarm_model.modal.fit import FitOptions, PoleFit, fit_poles
from flexarm_model.modal.frf import Frf
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


def draws_of(blocks: BlockSpectra) -> Callable[[np.random.Generator], Frf]:
    count = len(blocks.spectra)
    return lambda rng: blocks.frf("H1", "receptance", rng.integers(count, size=count)).frf.band(*BAND)


def test_its_sigma_is_the_scatter_of_repeated_measurements() -> None:
    runs = [measurement(seed) for seed in range(20)]
    scatter = np.std([fit.model.f_hz[0] for _, fit in runs], ddof=1)
    stated = np.median([
        bootstrap(draws_of(blocks), fit, FitOptions(), np.random.default_rng(0), 10).f_std_hz[0]
        for blocks, fit in runs[:4]
    ])  # fmt: skip
    assert stated == pytest.approx(scatter, rel=0.5)  # 20 runs know a scatter to 16 %, 40 draws to 12 %


def test_lines_that_are_masked_stay_masked_in_every_draw() -> None:
    blocks, fit = measurement(0)
    weight = np.ones(fit_lines(blocks))
    weight[:5] = 0.0
    spoilt = draws_of(blocks)

    def draw(rng: np.random.Generator) -> Frf:
        frf = spoilt(rng)
        H = frf.H.copy()
        H[:5] = 1e3 * rng.standard_normal()
        return Frf(frf.f_hz, H, frf.kind)

    rng = np.random.default_rng
    clean = bootstrap(spoilt, fit, FitOptions(weight=weight), rng(0), 6).f_std_hz[0]
    assert bootstrap(draw, fit, FitOptions(weight=weight), rng(0), 6).f_std_hz[0] < 3 * clean


def fit_lines(blocks: BlockSpectra) -> int:
    return blocks.frf("H1", "receptance").frf.band(*BAND).f_hz.size


def test_draws_that_cannot_be_fitted_are_told() -> None:
    _, fit = measurement(0)
    nothing = Frf(np.array([19.0, 20.0]), np.ones((2, 1, 1), complex))
    with pytest.raises(ValueError, match="only 0 of 3"):
        bootstrap(lambda rng: nothing, fit, FitOptions(), np.random.default_rng(0), 3)
