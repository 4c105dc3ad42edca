"""Shapers: amplitudes, exact convolution, and the vibration left in independently simulated modes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from flexarm_model.motion.profiles import JerkLimited, Profile, Quintic, Trapezoid
from flexarm_model.motion.shapers import Shaper, mzv, shape, shape_within, zv, zvd

OMEGA = 2.0 * math.pi * 5.23
WORST = Trapezoid.published("A", math.radians(10.0), 1.0 / 5.23)
STEPS_PER_PERIOD = 2000  # of the independent simulation


def residual(profile: Profile, omega: float, zeta: float) -> float:
    """Amplitude of ``q'' + 2 zeta omega q' + omega^2 q = -theta''`` when the motion has ended.

    Each step's change of velocity is an impulse at the end of the step (first order in the step),
    filtered by the sampled impulse response of the mode.
    """
    dt = 2.0 * math.pi / omega / STEPS_PER_PERIOD
    n = math.ceil(profile.duration / dt) + 1
    _, velocity, _ = profile.sample(np.arange(n + 1) * dt)
    pole = np.exp((-zeta + 1j * math.sqrt(1.0 - zeta**2)) * omega * dt)
    envelope = lfilter([1.0], [1.0, -pole], np.diff(velocity).astype(complex))  # complex amplitude
    return float(abs(envelope[-1]) / (omega * math.sqrt(1.0 - zeta**2)))


@settings(max_examples=50, deadline=None, derandomize=True)
@given(st.floats(1.0, 500.0), st.floats(0.0, 0.6), st.sampled_from([zv, zvd]))
def test_impulses_are_positive_add_up_to_one_and_leave_no_vibration(omega, zeta, make) -> None:  # type: ignore[no-untyped-def]
    shaper: Shaper = make(omega, zeta)
    amplitudes, delays = np.array(shaper.amplitudes), np.array(shaper.delays)
    assert amplitudes.min() > 0.0
    assert amplitudes.sum() == pytest.approx(1.0, rel=1e-12)
    growth = np.exp((zeta + 1j * math.sqrt(1.0 - zeta**2)) * omega * delays)
    assert abs(np.sum(amplitudes * growth)) < 1e-9 * abs(growth[-1])
    if make is zvd:  # first derivative in omega
        assert abs(np.sum(amplitudes * delays * growth)) < 1e-9 * abs(growth[-1]) * delays[-1]


@pytest.mark.parametrize("zeta", [0.0, 0.015, 0.1])
@pytest.mark.parametrize("profile", [WORST, Quintic(0.3, 0.4), JerkLimited(0.3, 0.03, 0.1, 0.1)])
def test_shaped_motion_leaves_no_vibration(profile: Profile, zeta: float) -> None:
    plain = residual(profile, OMEGA, zeta)
    for shaper in (zv(OMEGA, zeta), zvd(OMEGA, zeta)):
        # what is left is the sampling of the corners in the simulation, 1/2000 of a period
        assert residual(shape(profile, shaper), OMEGA, zeta) < 2e-3 * plain


def test_simulation_error_of_a_shaped_motion_vanishes_with_the_step(monkeypatch: pytest.MonkeyPatch) -> None:
    shaped = shape(WORST, zv(OMEGA, 0.015))
    coarse = residual(shaped, OMEGA, 0.015)
    monkeypatch.setitem(globals(), "STEPS_PER_PERIOD", 40 * STEPS_PER_PERIOD)
    assert residual(shaped, OMEGA, 0.015) < coarse / 20.0  # at least first order in the step


def test_zvd_is_flatter_than_zv_in_the_frequency() -> None:
    plain = residual(WORST, 1.05 * OMEGA, 0.015)
    left = [residual(shape(WORST, make(OMEGA, 0.015)), 1.05 * OMEGA, 0.015) / plain for make in (zv, zvd)]
    # two equal impulses at 5 % detuning: sin(pi / 2 * 0.05) = 0.078; three: its square
    assert left[0] == pytest.approx(math.sin(math.pi / 2 * 0.05), rel=0.05)
    assert left[1] == pytest.approx(math.sin(math.pi / 2 * 0.05) ** 2, rel=0.05)


def test_convolution_is_a_sum_of_delayed_profiles_at_any_time() -> None:
    shaper = Shaper("two", (0.0, 0.3), (0.25, 0.75))
    shaped = shape(Quintic(2.0, 1.0), shaper)
    angle, velocity, acceleration = shaped.sample([-1.0, 0.15, 1.3, 9.0])
    quintic = 2.0 * (10 * 0.15**3 - 15 * 0.15**4 + 6 * 0.15**5)
    np.testing.assert_allclose(angle, [0.0, 0.25 * quintic, 2.0, 2.0], rtol=1e-12)
    np.testing.assert_allclose([velocity[[0, 2, 3]], acceleration[[0, 2, 3]]], 0.0, atol=1e-12)
    assert shaped.duration == pytest.approx(1.3)


@pytest.mark.parametrize("make", [zv, zvd])
def test_motion_shaped_within_its_time_ends_when_it_did_before(make) -> None:  # type: ignore[no-untyped-def]
    shaped = shape_within(WORST, make(OMEGA, 0.015))
    assert shaped.duration == pytest.approx(WORST.duration, rel=1e-12)
    assert shaped.sample(WORST.duration)[0][0] == pytest.approx(WORST.theta, rel=1e-12)
    assert residual(shaped, OMEGA, 0.015) < 2e-3 * residual(WORST, OMEGA, 0.015)


def test_motion_shorter_than_its_shaper_is_refused() -> None:
    with pytest.raises(ValueError, match="ZVD takes"):
        shape_within(Quintic(0.1, 0.1), zvd(OMEGA, 0.0))
    with pytest.raises(ValueError, match="zeta = 1.0 in"):
        zv(OMEGA, 1.0)


@pytest.mark.parametrize("make", [zv, zvd, mzv])
@pytest.mark.parametrize("omega", [0.0, -1.0, math.nan, math.inf])
def test_a_mode_without_a_period_is_refused(make, omega) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(ValueError, match=f"omega = {omega} rad/s must be > 0 and finite"):
        make(omega, 0.0)
