"""The metrics against signals whose answer is known in closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flexarm_bringup import residual

RATE_HZ = 200.0
T = np.arange(0.0, 6.0, 1.0 / RATE_HZ)


def butterworth_gain(f_hz: float, rate_hz: float) -> float:
    """Return the gain of the digital filter run twice: its textbook magnitude, squared."""
    ratio = math.tan(math.pi * f_hz / rate_hz) / math.tan(math.pi * 20.0 / rate_hz)  # bilinear
    return 1.0 / (1.0 + ratio ** (2 * 4))


@pytest.mark.parametrize("rate_hz", [200.0, 512.0])
@pytest.mark.parametrize("f_hz", [1.0, 5.0, 15.0, 20.0, 40.0])
def test_residual_of_a_sine_is_its_rms_times_the_gain_of_the_filter(f_hz: float, rate_hz: float) -> None:
    t = np.arange(0.0, 6.0, 1.0 / rate_hz)
    signal = 3.0 * np.sin(2.0 * math.pi * f_hz * t)
    expected = 3.0 / math.sqrt(2.0) * butterworth_gain(f_hz, rate_hz)
    assert residual.residual_rms(t, signal, 2.0) == pytest.approx(
        expected, rel=3e-3
    )  # half a period in the window


def test_filter_does_not_delay() -> None:
    pulse = np.exp(-(((T - 3.0) / 0.05) ** 2))
    assert T[np.argmax(residual.lowpass(pulse, RATE_HZ))] == pytest.approx(3.0, abs=1e-9)


def test_only_the_window_counts() -> None:
    burst = np.where(T < 1.5, np.sin(2.0 * math.pi * 5.0 * T), 0.0)
    assert residual.residual_rms(T, burst, 2.5) < 1e-6


@pytest.mark.parametrize(("ratio", "db"), [(1.0, 0.0), (0.1, -20.0), (0.5, -6.0206), (0.0, -math.inf)])
def test_decibels_of_amplitudes(ratio: float, db: float) -> None:
    assert residual.decibels(2.0 * ratio, 2.0) == pytest.approx(db, abs=1e-4)


def test_settling_of_a_decaying_error_is_a_logarithm() -> None:
    error = 0.004 * np.exp(-2.0 * (T - 1.0))
    expected = math.log(0.004 / 0.0005) / 2.0
    assert residual.settling_time(T, error, 1.0) == pytest.approx(expected, abs=1e-4)  # interpolation


def test_settling_before_the_end_of_the_motion_is_negative() -> None:
    error = np.clip(0.010 - 0.010 * T / 1.0, 0.0, None)
    assert residual.settling_time(T, error, 1.0) == pytest.approx(-0.05, abs=1e-9)
    assert residual.settling_time(T, 0.0 * T, 1.0) == -1.0


def test_an_error_that_stays_or_is_not_a_number_does_not_settle() -> None:
    assert residual.settling_time(T, 0.001 + 0.0 * T, 1.0) == math.inf
    lost = np.where(T > 5.0, np.nan, 0.0)
    assert residual.settling_time(T, lost, 1.0) == math.inf
    gap = np.where((T > 2.0) & (T < 3.0), np.nan, 0.0)
    assert residual.settling_time(T, gap, 1.0) == pytest.approx(2.0, abs=0.006)


def test_records_that_cannot_be_judged_are_refused() -> None:
    with pytest.raises(ValueError, match="does not cover"):
        residual.residual_rms(T, T, 4.5)
    with pytest.raises(ValueError, match="equal distances"):
        residual.sample_rate(np.sort(np.random.default_rng(1).uniform(0.0, 6.0, 900)))
    with pytest.raises(ValueError, match="cannot be filtered"):
        residual.lowpass(np.zeros(100), 40.0)
