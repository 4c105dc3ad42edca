"""Output-only identification: modes of a chain shaken by noise nobody measured."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from flexarm_model.identification.ssi import output_modes
from flexarm_model.modal.mac import mac
from flexarm_model.modal.modes import normal_modes

RATE, BAND = 100.0, (2.0, 30.0)
M = np.diag([1.0, 1.2, 0.8])
K = 4e3 * (2 * np.eye(3) - np.eye(3, k=1) - np.eye(3, k=-1))
MODES = normal_modes(M, 4e-4 * K, K)


def shaken(seconds: float, seed: int) -> np.ndarray:
    """Return positions of the chain under white forces, with 5 % of noise, (samples, 3)."""
    D = 4e-4 * K
    A = np.block([[np.zeros((3, 3)), np.eye(3)], [-np.linalg.solve(M, K), -np.linalg.solve(M, D)]])
    step, rng = expm(A / RATE), np.random.default_rng(seed)
    kicks = np.vstack([np.zeros((3, 3)), np.linalg.inv(M)])
    y, x = np.empty((round(seconds * RATE), 3)), np.zeros(6)
    for k in range(len(y)):
        x = step @ x + kicks @ rng.standard_normal(3)
        y[k] = x[:3]
    return np.asarray(y + 0.05 * y.std() * rng.standard_normal(y.shape))


def test_frequencies_damping_and_shapes_are_found_without_the_input() -> None:
    found = output_modes(shaken(300.0, 0), RATE, BAND)
    assert found.f_hz == pytest.approx(MODES.f_hz, rel=0.005)
    assert found.zeta == pytest.approx(MODES.zeta, rel=0.35)
    assert np.diag(mac(found.shapes.T, MODES.shapes)) == pytest.approx(np.ones(3), abs=0.02)


def test_the_scatter_over_parts_is_of_the_size_of_the_error() -> None:
    found = output_modes(shaken(300.0, 1), RATE, BAND)
    assert (abs(found.f_hz - MODES.f_hz) < 5 * found.f_std_hz).all()
    assert (found.f_std_hz < 0.01 * found.f_hz).all()


def test_white_noise_alone_has_no_lasting_mode() -> None:
    noise = np.random.default_rng(3).standard_normal((20_000, 2))
    assert output_modes(noise, RATE, BAND).f_hz.size == 0


def test_a_record_that_is_too_short_is_refused_with_numbers() -> None:
    with pytest.raises(ValueError, match="are needed from 4 Hz on"):
        output_modes(np.ones((500, 3)), RATE, (4.0, 30.0))
