"""Half of a record predicts the other half: known systems do, noise and growing modes are refused."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from flexarm_model.identification.half_prediction import Halved, predict_half

DT, N = 0.005, 4000
F_HZ, ZETA = np.array([4.7, 19.0]), np.array([0.02, 0.03])
OMEGA = 2 * np.pi * F_HZ
POLES = OMEGA * (-ZETA + 1j * np.sqrt(1 - ZETA**2))
BAND = (1.0, 40.0)


def arm(kind: str, noise: float = 0.0, is_held: bool = True, seed: int = 0) -> Halved:
    """Two oscillators side by side under one input, stepped by the matrix exponential."""
    A = np.zeros((4, 4))
    A[:2, 2:], A[2:, :2], A[2:, 2:] = np.eye(2), -np.diag(OMEGA**2), -np.diag(2 * ZETA * OMEGA)
    B = np.array([[0.0], [0.0], [1.0], [3.0]])
    C, D = {"receptance": (np.array([[1.0, 1.0, 0, 0]]), 0.0), "accelerance": (A[2:].sum(0)[None], 4.0)}[kind]
    rng = np.random.default_rng(seed)
    u = signal.lfilter(*signal.butter(2, 0.5), rng.standard_normal(N))
    step = signal.cont2discrete((A, B, C, np.array([[D]])), DT, "zoh" if is_held else "foh")
    y = signal.dlsim(step[:4] + (DT,), u)[1]
    y += noise * y.std() * rng.standard_normal(y.shape)
    return Halved(u[:, None], y, DT, is_held, BAND)


@pytest.mark.parametrize("kind", ["receptance", "accelerance"])
@pytest.mark.parametrize("is_held", [True, False])
def test_the_right_modes_predict_everything(kind: str, is_held: bool) -> None:
    found = predict_half(POLES, [arm(kind, is_held=is_held)])
    assert not found.refusal
    assert found.first[0] > 99.9 and found.second[0] > 99.9  # edges of the band filter


def test_noise_is_what_is_not_predicted() -> None:
    """White noise of a tenth: 40 of 100 Hz are in the band, and little of the signal is outside."""
    found = predict_half(POLES, [arm("receptance", noise=0.1)])
    assert 100.0 - found.second[0] == pytest.approx(10.0 * np.sqrt(39 / 100), rel=0.1)


def test_a_wrong_frequency_predicts_less_than_the_right_one() -> None:
    record = arm("receptance")
    assert predict_half(POLES * 1.03, [record]).second[0] < 80.0


def test_a_growing_mode_is_refused_by_its_frequency() -> None:
    growing = POLES.copy()
    growing[1] = -growing[1].conjugate()
    assert "19 Hz does not decay" in predict_half(growing, [arm("receptance")]).refusal


def test_modes_of_noise_are_refused() -> None:
    """The output has nothing to do with the input; 60 modes fit half of it, and predict nothing."""
    rng = np.random.default_rng(1)
    record = Halved(rng.standard_normal((1200, 1)), rng.standard_normal((1200, 1)), DT, True, BAND)
    many = 2 * np.pi * np.linspace(2.0, 38.0, 30) * (-0.02 + 1j)
    found = predict_half(many, [record])
    assert found.refusal.startswith("overfitted") and found.second[0] < found.first[0]


def test_a_model_that_leaves_clearly_more_in_the_half_it_has_not_seen_is_refused() -> None:
    """The second half is noisier by 30 %: what is left there is no echo of the first."""
    record, rng = arm("receptance"), np.random.default_rng(2)
    record.y[N // 2 :] += (
        0.3
        * record.y.std()
        * signal.lfilter(
            *signal.butter(2, [BAND[0] * 2 * DT, BAND[1] * 2 * DT], "bandpass"),
            rng.standard_normal((N // 2, 1)),
            axis=0,
        )
    )
    found = predict_half(POLES, [record])
    assert found.first[0] > 99.0 and 70.0 < found.second[0] < 93.0
    assert found.refusal.startswith("overfitted: output 1")


def test_more_terms_than_a_quarter_of_the_samples_are_refused() -> None:
    record = Halved(np.ones((100, 1)), np.ones((100, 1)), DT, True, BAND)
    assert "terms for 50 samples" in predict_half(np.repeat(POLES, 10), [record]).refusal


def test_no_mode_predicts_nothing() -> None:
    assert predict_half(np.zeros(0, complex), [arm("receptance")]).refusal == "there is no mode"


def test_two_runs_are_judged_together() -> None:
    one = predict_half(POLES, [arm("receptance", 0.2), arm("receptance", 0.0, seed=2)])
    assert 5.0 < 100.0 - one.second[0] < 10.0
