"""Noise of encoders behind low-passes, and what it does to a parameter."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from flexarm_model.identification.encoder_noise import left_behind, smoothest, white_noise
from flexarm_model.identification.regressor_quality import balance_sizes, condition, weakest


def test_what_a_low_pass_leaves_of_noise_is_what_a_filtered_record_has() -> None:
    """2e5 samples know a variance behind 8 Hz to 1 %."""
    rng, dt, cutoff = np.random.default_rng(0), 0.005, 8.0
    noise = 3e-4 * rng.standard_normal((200_000, 1))
    kept = sosfiltfilt(butter(4, 2 * cutoff * dt, output="sos"), noise, axis=0)
    rates = np.gradient(kept, dt, axis=0)
    position, velocity, acceleration = left_behind(white_noise(noise), cutoff, dt)
    assert np.var(kept) == pytest.approx(position[0], rel=0.03)
    assert np.var(rates) == pytest.approx(velocity[0], rel=0.04)
    assert np.var(np.gradient(rates, dt, axis=0)) == pytest.approx(acceleration[0], rel=0.06)


def test_the_smoothest_cut_off_leaves_half_the_slope_of_friction() -> None:
    sigma, dt = np.array([1e-5, 3e-4]), 0.005
    cutoff = smoothest(sigma, dt, 0.01)
    assert np.sqrt(left_behind(sigma, cutoff, dt)[1].max()) == pytest.approx(0.005, rel=1e-9)
    assert smoothest(np.zeros(2), dt, 0.01) == np.inf


def test_a_balance_without_torque_is_as_large_as_its_largest_part() -> None:
    t = np.linspace(0.0, 10.0, 2000)
    X = np.zeros((t.size, 2, 3))
    X[:, 0, 0], X[:, 1, 1], X[:, 1, 2] = np.sin(t), np.sin(2 * t), np.cos(2 * t)
    y = np.column_stack([4.0 * np.sin(t), np.zeros(t.size)])
    size = balance_sizes(np.array([4.0, 100.0, 0.1]), X, y)
    assert size == pytest.approx([4.0 * np.std(np.sin(t)), 100.0 * np.std(np.sin(2 * t))])
    assert condition(X, size) == pytest.approx(1.0, abs=0.1)  # three signals that have nothing in common
    X[:, 1, 2] = 1.001 * X[:, 1, 1] + 1e-3 * np.cos(7 * t)
    assert condition(X, size) > 1e3
    assert "spring" in weakest(["rotor", "spring", "link"], X, size).split("(")[0]
