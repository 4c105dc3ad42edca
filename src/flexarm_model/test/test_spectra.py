"""Responses from records: exact without noise, biased as each estimator is known to be, coherent as noise."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from flexarm_model.identification.spectra import ESTIMATORS, MeasuredFrf, SpectrumSettings, measure_frf

RATE, SAMPLES, BLOCK = 500.0, 60_000, 2048
F1, DAMPING = 40.0, 0.05


def oscillator() -> tuple[np.ndarray, np.ndarray]:
    omega = 2 * np.pi * F1
    b, a, _ = signal.cont2discrete(([omega**2], [1.0, 2 * DAMPING * omega, omega**2]), 1 / RATE, method="zoh")
    return b.ravel(), a


def truth(f_hz: np.ndarray) -> np.ndarray:
    return np.asarray(signal.freqz(*oscillator(), f_hz, fs=RATE)[1])


def measured(estimator: str, on_input: float, on_output: float, seed: int = 0) -> MeasuredFrf:
    rng = np.random.default_rng(seed)
    x = rng.standard_normal(SAMPLES)
    y = signal.lfilter(*oscillator(), x)
    x = x + on_input * rng.standard_normal(SAMPLES)
    y = y + on_output * y.std() * rng.standard_normal(SAMPLES)
    return measure_frf([x[:, None]], [y[:, None]], RATE, SpectrumSettings(BLOCK, estimator=estimator))


def bias(found: MeasuredFrf) -> float:
    near = slice(np.searchsorted(found.frf.f_hz, 35.0), np.searchsorted(found.frf.f_hz, 45.0))
    return float(np.mean(abs(found.frf.H[near, 0, 0]) / abs(truth(found.frf.f_hz[near]))) - 1)


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_without_noise_all_estimators_give_the_response(estimator: str) -> None:
    assert abs(bias(measured(estimator, 0.0, 0.0))) < 0.01


def test_noise_on_the_output_does_not_bias_h1_and_lifts_h2() -> None:
    assert abs(bias(measured("H1", 0.0, 1.0))) < 0.02
    assert bias(measured("H2", 0.0, 1.0)) > 0.03


def test_noise_on_the_input_does_not_bias_h2_and_lowers_h1() -> None:
    assert abs(bias(measured("H2", 0.5, 0.0))) < 0.02
    assert bias(measured("H1", 0.5, 0.0)) == pytest.approx(1 / 1.25 - 1, abs=0.02)


def test_hv_is_the_geometric_mean_of_h1_and_h2_with_the_phase_of_h1() -> None:
    h1, h2, hv = (measured(name, 0.3, 0.3).frf.H[1:, 0, 0] for name in ESTIMATORS)
    assert abs(hv) == pytest.approx(np.sqrt(abs(h1) * abs(h2)), rel=1e-9)
    assert np.angle(hv / h1) == pytest.approx(np.zeros(h1.size), abs=1e-9)


@pytest.mark.parametrize("estimator", ["H1", "Hv"])
def test_two_inputs_at_once_are_parted(estimator: str) -> None:
    rng = np.random.default_rng(2)
    x = rng.standard_normal((SAMPLES, 2))
    first, second = (signal.lfilter(*oscillator(), column) for column in x.T)
    y = np.column_stack([first - 0.5 * second, 2.0 * second])
    found = measure_frf([x], [y], RATE, SpectrumSettings(BLOCK, estimator=estimator)).frf
    line = int(np.argmin(abs(found.f_hz - F1)))
    expected = truth(found.f_hz)[line] * np.array([[1.0, -0.5], [0.0, 2.0]])
    assert found.H[line] == pytest.approx(expected, abs=0.03 * abs(expected).max())


def test_coherence_is_the_share_of_the_power_that_the_input_explains() -> None:
    found = measured("H1", 0.0, 1.0)
    line = int(np.argmin(abs(found.frf.f_hz - F1)))
    density = signal.welch(signal.lfilter(*oscillator(), np.random.default_rng(0).standard_normal(SAMPLES)),
                           RATE, nperseg=BLOCK)[1]  # fmt: skip
    noise = density.sum() / density.size  # white, of the same total power
    share = density[line] / (density[line] + noise)
    assert found.coherence[line, 0] == pytest.approx(share, abs=0.03)


def test_a_transient_in_a_boxcar_tells_the_response_at_rest_too() -> None:
    """A kick and what follows it have a mean, and its ratio is the static compliance."""
    x = np.zeros((BLOCK, 1))
    x[5:9] = 1.0
    y = signal.lfilter(*oscillator(), x, axis=0)
    found = measure_frf([x], [y], RATE, SpectrumSettings(BLOCK, window="boxcar"))
    np.testing.assert_allclose(found.frf.H[:40, 0, 0], truth(found.frf.f_hz[:40]), rtol=1e-6)


def test_blocks_of_several_runs_are_averaged() -> None:
    rng = np.random.default_rng(3)
    runs = [rng.standard_normal((3 * BLOCK, 1)) for _ in range(4)]
    found = measure_frf(runs, runs, RATE, SpectrumSettings(BLOCK, overlap=0.0, window="boxcar"))
    assert found.frf.H[:, 0, 0] == pytest.approx(np.ones(BLOCK // 2 + 1), abs=1e-12)


@pytest.mark.parametrize(
    ("x", "settings", "message"),
    [
        (np.ones((10, 1)), SpectrumSettings(BLOCK), "shorter than a block"),
        (np.full((BLOCK, 1), np.nan), SpectrumSettings(BLOCK), "not finite"),
        (np.ones((BLOCK, 2)), SpectrumSettings(BLOCK, estimator="H2"), "H2 needs one input"),
        (np.ones((BLOCK, 2)), SpectrumSettings(BLOCK), "cannot part 2 inputs"),
    ],
)
def test_what_cannot_be_averaged_is_refused(x: np.ndarray, settings: SpectrumSettings, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        measure_frf([x], [np.ones((len(x), 1))], RATE, settings)


def test_inputs_that_move_together_are_refused() -> None:
    x = np.random.default_rng(5).standard_normal((SAMPLES, 1))
    with pytest.raises(ValueError, match="told apart"):
        measure_frf([np.hstack([x, 2 * x])], [x], RATE, SpectrumSettings(BLOCK))


def test_settings_outside_their_range_are_refused() -> None:
    with pytest.raises(ValueError, match="H1, H2, Hv"):
        SpectrumSettings(BLOCK, estimator="H3")
