"""Shapers that tolerate a little: closed forms, printed polynomials, widths, and simulated vibration."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.signal import lfilter

from flexarm_model.motion.hump_shapers import TOLERANCE, ei, three_hump, two_hump
from flexarm_model.motion.shapers import Shaper, convolve, mzv, zv, zvd

OMEGA = 2.0 * math.pi  # one period is one second
MAKERS = [zv, mzv, zvd, ei, two_hump, three_hump]
EXTRA = [ei, two_hump, three_hump]


def vibration_left(shaper: Shaper, omega: float, zeta: float) -> float:
    """Vibration after the last impulse over that of one impulse, by stepping an oscillator."""
    dt = 2.0 * math.pi / omega / 2000
    force = np.zeros(round(shaper.duration / dt) + 2, complex)
    pole = (-zeta + 1j * math.sqrt(1.0 - zeta**2)) * omega
    for delay, amplitude in zip(shaper.delays, shaper.amplitudes, strict=True):
        step = math.ceil(delay / dt - 1e-9)
        force[step] += amplitude * np.exp(pole * (step * dt - delay))  # where it is one step later
    return float(abs(lfilter([1.0], [1.0, -np.exp(pole * dt)], force)[-1]))


@pytest.mark.parametrize("make", MAKERS)
@pytest.mark.parametrize("zeta", [0.0, 0.015, 0.1, 0.3])
def test_amplitudes_are_positive_and_add_up_to_one(make: Callable[..., Shaper], zeta: float) -> None:
    shaper = make(OMEGA, zeta)
    assert min(shaper.amplitudes) > 0.0 and shaper.delays[0] == 0.0
    assert sum(shaper.amplitudes) == pytest.approx(1.0, abs=1e-9)  # to which the equations are solved


@pytest.mark.parametrize("zeta", [0.0, 0.05, 0.2])
def test_vibration_left_at_the_designed_frequency_is_zero_or_the_tolerance(zeta: float) -> None:
    wanted = {zv: 0.0, mzv: 0.0, zvd: 0.0, ei: TOLERANCE, two_hump: 0.0, three_hump: TOLERANCE}
    for make, left in wanted.items():
        # 1/2000 of a period is lost at the last impulse
        assert vibration_left(make(OMEGA, zeta), OMEGA, zeta) == pytest.approx(left, abs=2e-4)


@pytest.mark.parametrize(
    ("make", "width"),  # share of the frequency over which less than 5 % is left [Singhose1997]
    [(zv, 0.065), (zvd, 0.286), (ei, 0.399), (two_hump, 0.726), (three_hump, 0.956)],
)
def test_insensitivity_is_as_published(make: Callable[..., Shaper], width: float) -> None:
    shaper = make(OMEGA, 0.0)
    near = np.arange(0.4, 1.6, 0.005)
    is_low = np.array([vibration_left(shaper, OMEGA * w, 0.0) < 1.01 * TOLERANCE for w in near])
    assert is_low.sum() * 0.005 == pytest.approx(width, abs=0.015)  # printed widths differ by as much
    middle = is_low[np.argmax(is_low) : near.size - np.argmax(is_low[::-1])]
    assert middle.all()


@pytest.mark.parametrize("make", EXTRA)
@pytest.mark.parametrize("zeta", [0.0, 0.1])
def test_no_hump_is_higher_than_the_tolerance(make: Callable[..., Shaper], zeta: float) -> None:
    shaper = make(OMEGA, zeta, 0.1)
    left = [vibration_left(shaper, OMEGA * w, zeta) for w in np.linspace(0.8, 1.2, 41)]
    assert max(left) < 0.1 + 2e-4
    humps = {ei: 1, two_hump: 2, three_hump: 3}[make]
    wide = np.array([vibration_left(shaper, OMEGA * w, zeta) for w in np.linspace(0.45, 1.55, 201)])
    peaks = (wide[1:-1] > wide[:-2]) & (wide[1:-1] > wide[2:]) & (wide[1:-1] > 0.09)
    assert peaks.sum() == humps


@pytest.mark.parametrize("zeta", [0.0, 0.05, 0.1, 0.2, 0.3])
def test_damped_two_hump_shaper_is_the_printed_polynomial(zeta: float) -> None:
    powers = zeta ** np.arange(4)  # [Singhose1997], tolerance 5 %, times in undamped periods
    times = [[0.49890, 0.16270, -0.54262, 6.16180], [0.99748, 0.18382, -1.58270, 8.17120],
             [1.49920, -0.09297, -0.28338, 1.85710]]  # fmt: skip
    amplitudes = [[0.16054, 0.76699, 2.26560, -1.22750], [0.33911, 0.45081, -2.58080, 1.73650],
                  [0.34089, -0.61533, -0.68765, 0.42261], [0.15997, -0.60246, 1.00280, -0.93145]]  # fmt: skip
    shaper = two_hump(OMEGA, zeta)
    np.testing.assert_allclose(
        shaper.delays[1:], np.array(times) @ powers, atol=0.005
    )  # of the fit, at its end
    np.testing.assert_allclose(shaper.amplitudes, np.array(amplitudes) @ powers, atol=0.002)


def test_undamped_shapers_have_their_closed_forms() -> None:
    np.testing.assert_allclose(ei(OMEGA, 0.0).amplitudes, [0.2625, 0.475, 0.2625], atol=1e-12)
    np.testing.assert_allclose(ei(OMEGA, 0.0).delays, [0.0, 0.5, 1.0], atol=1e-9)
    np.testing.assert_allclose(three_hump(OMEGA, 0.0).delays, [0.0, 0.5, 1.0, 1.5, 2.0], atol=1e-9)


@pytest.mark.parametrize(
    ("make", "periods"), [(zv, 0.5), (mzv, 0.75), (zvd, 1.0), (ei, 1.0), (two_hump, 1.5), (three_hump, 2.0)]
)
def test_durations_are_whole_parts_of_the_period(make: Callable[..., Shaper], periods: float) -> None:
    assert make(OMEGA, 0.0).duration == pytest.approx(periods, rel=1e-9)
    assert make(3.0 * OMEGA, 0.0).duration == pytest.approx(periods / 3.0, rel=1e-9)


def test_convolved_shapers_cancel_both_modes() -> None:
    both = convolve(zv(OMEGA, 0.02), zvd(2.7 * OMEGA, 0.05))
    assert len(both.amplitudes) == 6 and sum(both.amplitudes) == pytest.approx(1.0)
    assert list(both.delays) == sorted(both.delays)
    assert both.duration == pytest.approx(zv(OMEGA, 0.02).duration + zvd(2.7 * OMEGA, 0.05).duration)
    assert vibration_left(both, OMEGA, 0.02) < 2e-4
    assert vibration_left(both, 2.7 * OMEGA, 0.05) < 2e-4


def test_shapers_that_do_not_exist_are_refused() -> None:
    with pytest.raises(ValueError, match="no positive impulses for zeta = 0.6"):
        three_hump(OMEGA, 0.6)
    with pytest.raises(ValueError, match="tolerance = 0"):
        ei(OMEGA, 0.0, 0.0)
