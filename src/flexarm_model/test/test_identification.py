"""Automatic identification: known answers with noise, nothing out of nothing, a measured beam."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from synthetic_frf import FINE, PLANAR_HZ, ZETA, locally_damped, pair, planar, rms_percent, with_noise
from tripod import tripod

from flexarm_model.identification.automatic import identify_modes
from flexarm_model.identification.lscf import poles_of_orders
from flexarm_model.identification.stabilisation import Track, lasting
from flexarm_model.modal.frf import Frf, Ports, modal_frf
from flexarm_model.modal.half_power import half_power
from flexarm_model.modal.modes import Modes
from flexarm_model.modal.peaks import pick_peaks

BEAM = Path(__file__).parent / "measured" / "free_free_beam.csv"
COARSE = np.arange(75.0, 151.0)  # 1 Hz lines about 96 and 129 Hz


def found_modes(frf: Frf) -> tuple[np.ndarray, np.ndarray]:
    fit = identify_modes(frf).fit
    assert fit is not None
    return fit.model.f_hz, fit.model.zeta


def test_poles_of_a_noise_free_response_are_exact_at_an_order_that_holds_them() -> None:
    poles, frf = locally_damped()
    at_order = poles_of_orders(frf, range(8, 9))[0]
    for pole in poles:
        assert abs(at_order.poles - pole).min() < 1e-3 * abs(pole)


def test_poles_that_only_mathematics_needs_come_out_unstable() -> None:
    _, clean = planar(0, zeta=0.02)
    for at_order in poles_of_orders(with_noise(clean, 40.0, np.random.default_rng(0)), range(5, 16)):
        assert abs(at_order.poles).size == 6


@pytest.mark.parametrize("zeta", [0.01, 0.02])
def test_six_modes_in_close_triplets_at_coarse_lines_are_found_from_three_references(zeta: float) -> None:
    for seed in range(3):
        _, clean = planar(seed, zeta)
        noisy = with_noise(clean, 40.0, np.random.default_rng(seed))
        f, damping = found_modes(noisy)
        print(
            f"seed {seed}: {f.size} of 6, worst {abs(f - PLANAR_HZ[3:9]).max():.4f} Hz; null: {nulls(noisy)}"
        )
        assert f == pytest.approx(PLANAR_HZ[3:9], abs=0.05)
        assert damping == pytest.approx(np.full(6, zeta), rel=0.05)


def nulls(frf: Frf) -> str:
    """Return what simpler methods read: half power on the largest cell, the chart of one reference."""
    o, i = np.unravel_index(abs(frf.H).max(axis=0).argmax(), frf.H.shape[1:])
    curve = abs(frf.H[:, o, i]) / abs(frf.s) ** frf.power
    peaks = [half_power_hz(frf.f_hz, curve, near) for near in PLANAR_HZ[3:9]]
    chart = poles_of_orders(Frf(frf.f_hz, frf.H[:, :, :1], frf.kind), range(2, 26))
    single = np.array([abs(track.pole) / (2 * np.pi) for track in lasting(chart)])
    read = np.unique(np.round([peak for peak in peaks if np.isfinite(peak)], 2)).size
    near = sum(bool(single.size) and abs(single - f).min() < 0.05 for f in PLANAR_HZ[3:9])
    return f"half power {read} peaks, one reference {near} of 6"


def half_power_hz(f_hz: np.ndarray, curve: np.ndarray, near: float) -> float:
    try:
        return half_power(f_hz, curve, near).f_hz
    except ValueError:
        return np.nan


def test_a_single_reference_does_not_part_the_triplets() -> None:
    _, clean = planar(0, 0.01)
    noisy = with_noise(clean, 40.0, np.random.default_rng(0))
    fit = identify_modes(Frf(noisy.f_hz, noisy.H[:, :, :1], noisy.kind)).fit
    assert fit is None or fit.model.f_hz.size < 6 or abs(fit.model.f_hz - PLANAR_HZ[3:9]).max() > 0.05


def test_two_modes_a_bandwidth_apart_are_both_found_at_30_db() -> None:
    modes, clean = pair(6.0)
    rng = np.random.default_rng(4)
    found, null = [], []
    for _ in range(12):
        noisy = with_noise(clean, 30.0, rng)
        found.append(found_modes(noisy))
        peaks = pick_peaks(noisy.f_hz, np.linalg.norm(noisy.H[:, :, 0], axis=1), noisy.power, 3.0)
        null.append(len(peaks))
    f = rms_percent([f for f, _ in found], modes.f_hz[:2])
    zeta = rms_percent([zeta for _, zeta in found], np.full(2, ZETA))
    print(f"both in 12 of 12: f {f} %, zeta {zeta} %; half power sees {np.mean(null):.1f} peaks")
    assert (f <= 0.1).all() and (zeta <= 4.0).all()


def test_96_and_129_hz_are_found_at_40_db_with_damping_and_stiffness() -> None:
    machine, rng = tripod("sim"), np.random.default_rng(9)
    force = machine.force(machine.tool, 10.0)
    clean = machine.drive_point(COARSE, machine.tool, force)
    truth, damping = machine.modes.f_hz[:2], machine.modes.zeta[:2]
    stiff = machine.modes.omega[1] ** 2 / np.sum((machine.tool @ machine.modes.shapes[:, 1]) ** 2)
    rows: dict[str, list[np.ndarray]] = {name: [] for name in ("f", "zeta", "k", "null f", "null zeta")}
    for _ in range(12):
        noisy = with_noise(clean, 40.0, rng)
        fit = identify_modes(noisy).fit
        assert fit is not None and fit.model.f_hz.size == 2
        peaks = [half_power(COARSE, np.linalg.norm(noisy.H[:, :, 0], axis=1), near) for near in truth]
        values = (
            fit.model.f_hz, fit.model.zeta, fit.model.modal_stiffness(force)[1:],
            np.array([peak.f_hz for peak in peaks]), np.array([peak.zeta for peak in peaks]),
        )  # fmt: skip
        for name, value in zip(rows, values, strict=True):
            rows[name].append(value)
    rms = {
        name: rms_percent(values, {"f": truth, "a": damping, "k": np.array([stiff])}[name[-1]])
        for name, values in rows.items()
    }
    print("rms [%]:", {name: np.round(value, 3).tolist() for name, value in rms.items()})
    assert (rms["f"] <= 0.03).all() and (rms["zeta"] <= 1.0).all() and rms["k"][0] <= 1.0
    assert (rms["null zeta"] > rms["zeta"]).all()


def test_an_exact_pair_stays_two_modes() -> None:
    omega = 2 * np.pi * np.array([20.4084, 20.4084])
    doublet = Modes(omega, 0.02 * omega, np.array([[0.8, -0.6], [0.6, 0.8]]))
    clean = modal_frf(np.arange(15.0, 26.0, 0.3125), doublet, Ports(np.eye(2), np.eye(2)), "accelerance")
    f, _ = found_modes(with_noise(clean, 60.0, np.random.default_rng(3)))
    assert f == pytest.approx([20.4084, 20.4084], abs=0.002)


@pytest.mark.parametrize("n_in", [1, 2])
def test_noise_alone_has_no_modes(n_in: int) -> None:
    for seed in range(5):
        rng = np.random.default_rng(seed)
        H = rng.standard_normal((COARSE.size, 3, n_in)) + 1j * rng.standard_normal((COARSE.size, 3, n_in))
        assert identify_modes(Frf(COARSE, H)).fit is None


@pytest.mark.parametrize("size", [1.0, 1e-7])
def test_a_response_without_a_mode_has_none_even_without_noise(size: float) -> None:
    """A pole of rounding stands out of rounding: 21 Hz of a response of one on every line."""
    lines = 0.5 * np.arange(1.0, 101.0)
    assert identify_modes(Frf(lines, np.full((lines.size, 1, 1), size + 0.0j))).fit is None


def test_a_mode_that_few_orders_show_does_not_last() -> None:
    _, clean = pair(12.0)
    chart = poles_of_orders(clean, range(2, 20))
    assert all(isinstance(track, Track) and len(track.orders) >= 9 for track in lasting(chart))


def test_uneven_or_too_few_lines_are_refused_with_numbers() -> None:
    _, clean = pair(12.0)
    with pytest.raises(ValueError, match="needed are at least 404"):
        poles_of_orders(clean, range(2, 202))
    uneven = FINE.copy()
    uneven[5] += 0.2
    with pytest.raises(ValueError, match="rounded frequencies need more digits"):
        poles_of_orders(Frf(uneven, clean.H), range(2, 5))


def test_frequencies_of_a_measured_beam_follow_theory_and_its_damping_is_not_known() -> None:
    table = np.loadtxt(BEAM, delimiter=",", skiprows=1)
    H = table[:, 1::2] + 1j * table[:, 2::2]
    fit = identify_modes(Frf(table[:, 0], H[:, :, None], "accelerance").band(5.0, 1000.0)).fit
    assert fit is not None
    beta = np.array([4.730041, 7.853205, 10.995608, 14.137165, 17.278760, 20.420352])  # free-free, tan = tanh
    assert fit.model.f_hz / fit.model.f_hz[0] == pytest.approx((beta / beta[0]) ** 2, rel=0.003)
    assert (fit.lines_per_bandwidth < 1.0).all()


def test_the_pole_of_a_track_is_what_it_has_settled_at() -> None:
    """At low orders a pole still bears the modes that the model has no room for."""
    settled = -0.3 + 40.0j
    poles = [-5.0 + 44.0j, -2.0 + 42.0j, -1.0 + 41.0j, settled, settled, settled]
    assert Track(list(range(6)), poles).pole == settled
