"""Excitation signals: their band, their crest factor, and that they repeat."""

from __future__ import annotations

import numpy as np
import pytest

from flexarm_model.identification.excitation import (
    SIGNALS,
    crest_factor,
    excitation,
    schroeder_multisine,
)

BAND, RATE, PERIOD = (2.0, 70.0), 200.0, 10.0


@pytest.mark.parametrize("name", sorted(SIGNALS))
def test_every_signal_has_peak_one_and_most_of_its_power_in_the_band(name: str) -> None:
    signal = excitation(name, BAND, RATE, PERIOD)
    assert abs(signal.signal).max() == pytest.approx(1.0)
    assert signal.period == pytest.approx(PERIOD, rel=0.5)
    assert signal.share_in_band > 0.6  # pseudo-random steps have a third of it above the band


def test_a_multisine_has_all_its_power_in_the_band_and_the_same_on_every_line() -> None:
    signal = excitation("multisine", BAND, RATE, PERIOD)
    spectrum = abs(np.fft.rfft(signal.signal))
    lines = np.arange(20, 701)  # 2 to 70 Hz, 0.1 Hz apart
    assert spectrum[lines] == pytest.approx(np.full(lines.size, spectrum[20]), rel=1e-9)
    assert signal.share_in_band == pytest.approx(1.0, abs=1e-12)


def test_clipping_brings_the_crest_factor_of_a_multisine_below_that_of_a_sine() -> None:
    signal = excitation("multisine", BAND, RATE, PERIOD)
    schroeder = crest_factor(schroeder_multisine(BAND, RATE, round(PERIOD * RATE)))
    noise = crest_factor(np.random.default_rng(0).standard_normal(2000))
    print(f"crest factor: clipped {signal.crest_factor:.2f}, Schroeder {schroeder:.2f}, noise {noise:.2f}")
    assert signal.crest_factor < np.sqrt(2.0) < schroeder < noise


def test_a_chirp_ends_where_it_begins_so_that_it_may_be_repeated() -> None:
    signal = excitation("chirp", BAND, RATE, PERIOD).signal
    step = abs(signal[0] - signal[-1])
    assert step <= 2 * np.pi * BAND[1] / RATE  # no more than between two samples at the highest frequency


def test_a_chirp_goes_through_the_whole_band_at_an_even_rate() -> None:
    signal = excitation("chirp", BAND, RATE, PERIOD).signal
    power = abs(np.fft.rfft(signal)) ** 2
    lines = np.array_split(power[20:701], 4)  # quarters of the band
    np.testing.assert_allclose([part.sum() / power.sum() for part in lines], 0.25, atol=0.05)


def test_pseudo_random_steps_have_the_correlation_of_an_impulse() -> None:
    signal = excitation("prbs", (2.0, 70.0), RATE, PERIOD).signal
    n = signal.size
    circular = np.fft.irfft(abs(np.fft.rfft(signal)) ** 2, n)
    assert circular[0] == pytest.approx(n) and circular[1:] == pytest.approx(np.full(n - 1, -1.0), abs=1e-6)


@pytest.mark.parametrize(
    ("name", "band", "message"),
    [
        ("noise", BAND, "not one of"),
        ("chirp", (2.0, 120.0), "does not fit"),
        ("chirp", (0.05, 50.0), "cycle of low"),
    ],
)
def test_what_cannot_be_made_is_refused_with_numbers(
    name: str, band: tuple[float, float], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        excitation(name, band, RATE, PERIOD)
