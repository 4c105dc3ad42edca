"""An input under feedback: H1 is biased and stays so, the signal asked for as instrument is not."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from flexarm_model.identification.excitation import excitation
from flexarm_model.identification.spectra import BlockSpectra, SpectrumSettings, block_spectra

RATE, GAIN = 200.0, 3.0
LINES = slice(15, 60)  # of 0.2 Hz


def closed_loop(periods: int, noise: float) -> tuple[BlockSpectra, np.ndarray]:
    """Return spectra of a resonance at 6 Hz under ``u = r - g (y + n)``, and its exact response."""
    omega = 2 * np.pi * 6.0
    b, a, _ = signal.cont2discrete(([omega**2], [1.0, 0.2 * omega, omega**2]), 1 / RATE, method="zoh")
    b = b.ravel()
    r = np.tile(excitation("multisine", (1.0, 20.0), RATE, 5.0).signal, periods + 2)
    n = noise * np.random.default_rng(0).standard_normal(r.size)
    u, y = np.zeros(r.size), np.zeros(r.size)
    for k in range(2, r.size):
        y[k] = b[1] * u[k - 1] + b[2] * u[k - 2] - a[1] * y[k - 1] - a[2] * y[k - 2]
        u[k] = r[k] - GAIN / 20 * (y[k] + n[k])
    keep, block = slice(-periods * 1000, None), SpectrumSettings(1000, 0.0, "boxcar")
    blocks = block_spectra([u[keep, None]], [(y + n)[keep, None]], RATE, block, [r[keep, None]])
    z = np.exp(2j * np.pi * blocks.f_hz / RATE)
    return blocks, np.polyval(b, z) / np.polyval(a, z)


def error(blocks: BlockSpectra, truth: np.ndarray, estimator: str) -> float:
    H = blocks.frf(estimator, "receptance").frf.H[LINES, 0, 0]
    return float(np.linalg.norm(H - truth[LINES]) / np.linalg.norm(truth[LINES]))


def test_h1_is_biased_by_feedback_and_averaging_does_not_help_but_the_instrument_finds_the_plant() -> None:
    few, truth = closed_loop(8, 5.0)
    many, _ = closed_loop(128, 5.0)
    h1, hc = ((error(few, truth, e), error(many, truth, e)) for e in ("H1", "Hc"))
    print(f"H1 {100 * h1[0]:.0f} % -> {100 * h1[1]:.0f} %, Hc {100 * hc[0]:.0f} % -> {100 * hc[1]:.0f} %")
    assert h1[1] > 0.75 * h1[0] and h1[1] > 3 * hc[1]  # bias stays
    assert hc[1] < 0.35 * hc[0]  # noise falls with the root of 16, here 0.25


def test_without_noise_both_are_exact_under_feedback() -> None:
    blocks, truth = closed_loop(3, 0.0)
    assert error(blocks, truth, "H1") < 1e-4 and error(blocks, truth, "Hc") < 1e-4


def test_without_an_instrument_the_estimator_says_so() -> None:
    blocks, _ = closed_loop(3, 0.0)
    with pytest.raises(ValueError, match="one instrument per input: 0 for 1"):
        BlockSpectra(blocks.f_hz, blocks.spectra[:, :, :2], 1).frf("Hc", "receptance")


def test_lines_that_were_not_driven_have_no_coherence() -> None:
    blocks, _ = closed_loop(8, 0.1)
    coherence = blocks.frf("Hc", "receptance").coherence[:, 0]
    assert not (coherence[120:] >= 0.0).any() and (coherence[LINES] > 0.5).all()
