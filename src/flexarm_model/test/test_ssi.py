"""Output-only identification: modes of a chain shaken by noise nobody measured."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from flexarm_model.identification.joined_tracks import lasting_modes
from flexarm_model.identification.lscf import OrderPoles
from flexarm_model.identification.ssi import _about, _of_the_mean, output_modes
from flexarm_model.modal.mac import mac
from flexarm_model.modal.modes import normal_modes

RATE, BAND = 100.0, (2.0, 30.0)
M = np.diag([1.0, 1.2, 0.8])
K = 4e3 * (2 * np.eye(3) - np.eye(3, k=1) - np.eye(3, k=-1))
MODES = normal_modes(M, 4e-4 * K, K)


def let_go(seconds: float, noise: float) -> np.ndarray:
    """Return the same after it was let go once, with noise over the largest, (samples, 3)."""
    t = np.arange(0.0, seconds, 1 / RATE)[:, None]
    omega, zeta = 2 * np.pi * MODES.f_hz, MODES.zeta
    modal = np.exp(-zeta * omega * t) * np.cos(omega * np.sqrt(1 - zeta**2) * t)
    y = modal @ MODES.shapes.T
    return np.asarray(y + noise * abs(y).max() * np.random.default_rng(5).standard_normal(y.shape))


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


def test_the_uncertainty_is_of_the_size_of_the_error() -> None:
    found = output_modes(shaken(300.0, 1), RATE, BAND)
    assert (abs(found.f_hz - MODES.f_hz) < 3 * found.f_std_hz).all()
    assert (found.f_std_hz < 0.01 * found.f_hz).all() and not found.rings_down


def test_two_parts_that_agree_by_chance_do_not_make_a_mode_sure() -> None:
    """Of 76 modes 22 % lay beyond 3 sigma and 8 % beyond 10; one damping was 1.163 +- 0.00001 %."""
    off = []
    for seed in range(6):
        found = output_modes(shaken(45.0, seed), RATE, BAND, parts=2)
        for f, zeta, f_std, zeta_std in zip(
            found.f_hz, found.zeta, found.f_std_hz, found.zeta_std, strict=True
        ):
            k = int(np.argmin(abs(MODES.f_hz - f)))
            off += [(f - MODES.f_hz[k]) / f_std, (zeta - MODES.zeta[k]) / zeta_std]
            assert min(zeta_std, f_std / f) > 0.999 * np.sqrt(zeta / (2 * np.pi * f * 45.0))
    assert len(off) >= 24 and abs(np.array(off)).max() < 4.0


@pytest.mark.parametrize("parts", [2, 3, 4])
def test_one_sigma_of_the_mean_of_few_values_holds_two_thirds_of_them(parts: int) -> None:
    values = np.full((100_000, 5), np.nan)
    values[:, :parts] = np.random.default_rng(6).standard_normal((100_000, parts))
    inside = abs(values[:, :parts].mean(axis=1)) < _of_the_mean(values)
    assert np.mean(inside) == pytest.approx(0.683, abs=0.01)  # 0.50 of two without Student's factor


def test_what_the_parts_contradict_is_as_uncertain_as_they_are_far_from_it() -> None:
    """22.235 +- 0.023 Hz was told of 22 Hz, of which all four parts said 22.01 to 22.09."""
    parts = np.array([[22.085, 22.080, 22.008, 22.086], [1.0, np.nan, np.nan, np.nan]])
    sigma = _about(np.array([22.235, 1.1]), parts)
    assert sigma[0] == pytest.approx(np.hypot(_of_the_mean(parts)[0], 22.235 - parts[0].mean()))
    assert sigma[0] > 0.17 and not sigma[1] < np.inf
    agreed = _about(np.nanmean(parts, axis=1), parts)
    assert agreed[0] == pytest.approx(_of_the_mean(parts)[0])


@pytest.mark.parametrize(("seconds", "noise"), [(20.0, 0.0), (60.0, 1e-3)])
def test_what_rings_down_gives_its_modes_and_no_others(seconds: float, noise: float) -> None:
    """Dampings were too low by 1 / (2 pi f T), and a clean record had three times as many modes."""
    found = output_modes(let_go(seconds, noise), RATE, BAND, parts=2)
    assert found.rings_down and found.of_parts == 4 and min(found.parts) >= 3
    assert found.f_hz == pytest.approx(MODES.f_hz, rel=1e-6 if not noise else 1e-4)
    assert found.zeta == pytest.approx(MODES.zeta, rel=1e-4 if not noise else 1e-2)
    assert (abs(found.zeta - MODES.zeta) < 5 * found.zeta_std + 1e-7).all()
    assert np.diag(mac(found.shapes.T, MODES.shapes)) == pytest.approx(np.ones(3), abs=1e-3)


def test_what_is_cut_off_while_it_rings_has_the_right_damping_too() -> None:
    found = output_modes(let_go(20.0, 0.0)[:1400], RATE, (3.0, 30.0), parts=2)
    assert found.zeta == pytest.approx(MODES.zeta, rel=1e-4)


def test_a_heavily_damped_mode_whose_tracks_take_turns_is_found() -> None:
    """Every part showed it, half of them to one of its two tracks, so that both were dropped."""
    f_hz, zeta, rate = np.array([15.0, 28.0, 44.0]), np.array([0.1, 0.12, 0.08]), 256.0
    rng = np.random.default_rng(4)
    shapes = np.array([[1.0, 1.0, 0.5], [0.7, -0.4, -1.0], [-0.6, 0.9, 0.8], [0.2, -1.0, 0.4]])
    samples = round(120 * rate)
    lines = np.fft.rfftfreq(2 * samples, 1 / rate)[:, None]
    response = 1 / (f_hz**2 - lines**2 + 2j * zeta * f_hz * lines)  # (k, 3)
    kicks = np.fft.rfft(rng.standard_normal((2 * samples, 4)), axis=0) @ shapes
    y = np.fft.irfft(response * kicks, axis=0)[samples:] @ shapes.T
    y += 0.02 * y.std(axis=0) * rng.standard_normal(y.shape)
    found = output_modes(y, rate, (8.0, 60.0))
    assert found.f_hz == pytest.approx(f_hz, rel=0.02)
    assert found.zeta == pytest.approx(zeta, rel=0.15)


@pytest.mark.parametrize(
    ("other", "orders", "shape", "modes"),
    [
        (-9.8 + 96.0j, range(4, 42, 4), 0.52, 1),
        (-9.8 + 96.0j, range(2, 42, 2), 0.52, 2),  # side by side
        (-9.8 + 96.0j, range(4, 42, 4), -0.8, 2),  # of another shape
        (-9.8 + 102.6j, range(4, 42, 4), 0.52, 2),  # most of a bandwidth away
        (-1.0 + 94.0j, range(4, 42, 4), 0.52, 2),  # of light damping
    ],
)
def test_tracks_that_take_turns_are_one_mode_and_other_ones_are_two(
    other: complex, orders: range, shape: float, modes: int
) -> None:
    chart = []
    for order in range(2, 42, 2):
        here = [(-9.4 + 94.0j, 0.5)] if order % 4 else []
        here += [(other, shape)] if order in orders else []
        values = np.array([pole for pole, _ in here], complex)
        chart.append(OrderPoles(order, values, np.array([[1.0, part] for _, part in here], complex)))
    found = lasting_modes(chart)
    assert len(found) == modes
    if modes == 1:
        assert found[0].orders == list(range(2, 42, 2)) and len(found[0].participations) == 20


def test_what_too_few_parts_show_is_named_with_their_number() -> None:
    """A hum that ended was dropped without a word."""
    y = shaken(200.0, 2)
    t = np.arange(len(y)) / RATE
    y[:5000] += 0.5 * y.std() * np.sin(2 * np.pi * 24.3 * t[:5000])[:, None]
    found = output_modes(y, RATE, BAND)
    assert found.f_hz == pytest.approx(MODES.f_hz, rel=0.01)
    hum = next(mode for mode in found.dropped if abs(mode.f_hz - 24.3) < 0.05)
    assert hum.parts <= 1 and hum.of_parts == 4 and hum.zeta < 0.005


def test_white_noise_alone_has_no_lasting_mode() -> None:
    noise = np.random.default_rng(3).standard_normal((20_000, 2))
    assert output_modes(noise, RATE, BAND).f_hz.size == 0


def test_a_record_that_is_too_short_is_refused_with_numbers() -> None:
    with pytest.raises(ValueError, match="are needed from 4 Hz on"):
        output_modes(np.ones((500, 3)), RATE, (4.0, 30.0))
