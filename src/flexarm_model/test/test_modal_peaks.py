"""Peaks, half power and the CMIF: exact for one mode, and the numbers of seed 001."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_frf import locally_damped
from tripod import GOLDEN_HZ, tripod

from flexarm_model.modal.cmif import cmif, pick_modes, track_curves
from flexarm_model.modal.frf import Frf, Ports, modal_frf
from flexarm_model.modal.half_power import HalfPower, half_power
from flexarm_model.modal.mac import mac
from flexarm_model.modal.modes import Modes
from flexarm_model.modal.peaks import interpolate_peak, pick_peaks

GRID = np.arange(1.0, 801.0)  # seed 001: 1 Hz lines to 800 Hz
DIAGONAL = Ports(np.eye(2), np.eye(2))


def one_mode(f_hz: np.ndarray, f_0: float, zeta: float, kind: str = "receptance") -> np.ndarray:
    omega = np.array([2 * np.pi * f_0])
    modes = Modes(omega, 2 * zeta * omega, np.eye(1))
    return np.asarray(abs(modal_frf(f_hz, modes, Ports(np.eye(1), np.eye(1)), kind).H[:, 0, 0]))


@settings(deadline=None, derandomize=True)
@given(
    st.floats(20.0, 30.0), st.floats(1e-3, 0.1), st.sampled_from(["receptance", "mobility", "accelerance"])
)
def test_three_lines_tell_frequency_damping_and_height_of_one_mode(
    f_0: float, zeta: float, kind: str
) -> None:
    f = np.arange(10.0, 40.0, 0.25)
    magnitude = one_mode(f, f_0, zeta, kind)
    power = ("receptance", "mobility", "accelerance").index(kind)
    peak = interpolate_peak(f, magnitude, int(np.argmax(magnitude * f**-power)), power)
    assert peak.f_hz == pytest.approx(f_0, rel=1e-8)
    assert peak.zeta == pytest.approx(zeta, rel=1e-3)
    top = f_0 * np.sqrt(1 - 2 * zeta**2)
    assert peak.height == pytest.approx(one_mode(np.array([top]), f_0, zeta, kind)[0], rel=1e-6)


def test_peaks_below_the_prominence_are_left_out() -> None:
    f = np.arange(1.0, 100.0, 0.5)
    magnitude = one_mode(f, 20.0, 0.01) + 0.05 * one_mode(f, 60.0, 0.01)
    strict, loose = (pick_peaks(f, magnitude, prominence_db=level) for level in (30.0, 3.0))
    assert [round(peak.f_hz) for peak in strict] == [20]
    assert [round(peak.f_hz) for peak in loose] == [20, 60]
    assert strict[0].line_hz == 20.0


def test_lines_that_make_no_peak_give_the_line_itself() -> None:
    peak = interpolate_peak(np.array([1.0, 2.0, 3.0]), np.array([1.0, 1.0, 0.0]), 1)
    assert peak.f_hz == peak.line_hz == 2.0 and np.isnan(peak.zeta)
    straight = interpolate_peak(np.array([1.0, 2.0, 3.0]), np.array([1.0, 2.0, 3.0]), 1)
    assert straight.f_hz == 2.0 and straight.height == 2.0
    with pytest.raises(ValueError, match="edge of the record"):
        interpolate_peak(np.array([1.0, 2.0, 3.0]), np.array([1.0, 2.0, 3.0]), 2)


def test_the_tripod_has_the_golden_frequencies_of_seed_001() -> None:
    for preset, golden in GOLDEN_HZ.items():
        assert np.round(tripod(preset).modes.f_hz[:10], 2).tolist() == golden


@pytest.mark.parametrize(
    ("preset", "point", "expected"),
    [  # f_0, f_a, f_b, zeta, H_0 in mm/N, k: seed 001, section 4
        ("sim", "tool", (129, 126, 132, 0.02326, 0.0450, 4.776e5)),
        ("sim", "platform", (129, 126, 132, 0.02326, 0.0320, 6.718e5)),
        ("exp", "tool", (133, 131, 135, 0.01504, 0.0505, 6.59e5)),
        ("exp", "platform", (133, 131, 135, 0.01504, 0.0416, 8.00e5)),
    ],
)
def test_half_power_on_the_grid_gives_the_table_of_seed_001(
    preset: str, point: str, expected: tuple[float, ...]
) -> None:
    machine = tripod(preset)
    where = getattr(machine, point)
    H = machine.drive_point(GRID, where, machine.direction(where, 1)).H[:, :, 0]
    found = half_power(GRID, np.linalg.norm(H, axis=1), 130.0, interpolate=False)
    assert (found.f_hz, found.low_hz, found.high_hz) == expected[:3]
    assert found.zeta == pytest.approx(expected[3], abs=5e-6)
    assert found.height * 1e3 == pytest.approx(expected[4], abs=5e-5)
    assert found.stiffness == pytest.approx(expected[5], rel=8e-4)  # printed with three or four digits


@pytest.mark.parametrize(
    ("f_0", "low", "high", "height", "zeta", "stiffness"),
    [  # seed 001, section 5, recomputed
        (129.0, 126.0, 132.0, 0.032e-3, 0.02326, 6.72e5),
        (134.0, 132.5, 136.0, 0.052e-3, 0.01306, 7.36e5),
        (133.0, 131.0, 135.0, 0.0428e-3, 0.01504, 7.77e5),
    ],
)
def test_printed_readings_give_the_recomputed_damping_and_stiffness(
    f_0: float, low: float, high: float, height: float, zeta: float, stiffness: float
) -> None:
    reading = HalfPower(f_0, low, high, height)
    assert reading.zeta == pytest.approx(zeta, abs=5e-6)
    assert reading.stiffness == pytest.approx(stiffness, rel=1e-3)
    assert reading.mass * (2 * np.pi * f_0) ** 2 == pytest.approx(reading.stiffness)


def test_half_power_between_lines_beats_half_power_on_lines() -> None:
    f = np.arange(80.0, 180.0)
    errors = []
    for f_0 in np.linspace(129.0, 130.0, 11):
        magnitude = one_mode(f, f_0, 0.013)
        both = [half_power(f, magnitude, 129.0, interpolate) for interpolate in (False, True)]
        errors.append([found.zeta / 0.013 - 1 for found in both])
    on_lines, between = np.sqrt(np.mean(np.square(errors), axis=0))
    assert 0.05 < on_lines < 0.20  # the seed says 14.5 % rms on this grid
    assert between < 0.02


def test_half_power_needs_a_peak_that_falls_on_both_sides() -> None:
    f = np.arange(10.0, 21.0)
    with pytest.raises(ValueError, match="edge of the record"):
        half_power(f, one_mode(f, 40.0, 0.01), 15.0)
    with pytest.raises(ValueError, match="does not fall to half power before 20.0 Hz"):
        half_power(f, one_mode(f, 18.0, 0.2), 15.0)
    coarse = np.arange(1.0, 30.0, 1.0)
    with pytest.raises(ValueError, match="lines too coarse"):
        half_power(coarse, one_mode(coarse, 10.4, 1e-3), 10.0)


def crossing_pair() -> Frf:
    """Return two modes with shapes that no symmetry couples; the wide one crosses the narrow one twice."""
    omega = 2 * np.pi * np.array([20.0, 20.5])
    turned = np.array([[0.8, -0.6], [0.6, 0.8]])
    damping = 2 * np.array([0.01, 0.002]) * omega
    return modal_frf(np.arange(15.0, 26.0, 0.05), Modes(omega, damping, turned), DIAGONAL, "accelerance")


def test_tracked_curves_of_orthogonal_modes_are_their_own_resonances() -> None:
    frf = crossing_pair()
    curves = track_curves(cmif(frf))
    for mode, (f_0, zeta) in enumerate([(20.0, 0.01), (20.5, 0.002)]):
        assert curves.values[:, mode] == pytest.approx(one_mode(frf.f_hz, f_0, zeta, "accelerance"), rel=1e-9)
    assert curves.db(2.0)[0, 0] == pytest.approx(20 * np.log10(curves.values[0, 0] / 2.0))


def test_modes_under_one_peak_show_in_different_curves_with_their_shapes() -> None:
    found = pick_modes(track_curves(cmif(crossing_pair())))
    assert [item.peak.f_hz for item in found] == pytest.approx([20.0, 20.5], rel=1e-8)
    assert [item.peak.zeta for item in found] == pytest.approx([0.01, 0.002], rel=1e-4)
    shapes = np.array([[0.8, -0.6], [0.6, 0.8]])
    for item, shape in zip(found, shapes.T, strict=True):
        for vector in (item.shape, item.participation):
            assert mac(vector[:, None], shape[:, None])[0, 0] == pytest.approx(1.0, abs=1e-9)
    assert pick_modes(track_curves(cmif(crossing_pair())), lowest_hz=20.3)[0].peak.f_hz > 20.3


def test_sorted_curves_show_a_peak_where_no_mode_is() -> None:
    assert len(pick_modes(cmif(crossing_pair()), prominence_db=1.0)) > 2


def test_an_exact_doublet_shows_in_two_curves_at_once() -> None:
    omega = 2 * np.pi * np.array([20.4, 20.4])
    frf = modal_frf(np.arange(15.0, 26.0, 0.3125), Modes(omega, 0.02 * omega, np.eye(2)), DIAGONAL)
    found = pick_modes(cmif(frf))
    assert [item.curve for item in found] == [0, 1]
    assert [item.peak.f_hz for item in found] == pytest.approx([20.4, 20.4], rel=1e-9)
    assert abs(found[0].shape @ found[1].shape.conj()) < 1e-9


def test_singular_values_rebuild_the_responses() -> None:
    _, frf = locally_damped()
    curves = track_curves(cmif(frf))
    rebuilt = np.einsum("kom,km,kim->koi", curves.left, curves.values, curves.right)
    assert rebuilt == pytest.approx(frf.H, rel=1e-10)


def test_a_curve_that_is_no_number_somewhere_ends_the_climb() -> None:
    """It never ended."""
    magnitude = one_mode(GRID, 129.0, 0.013)
    magnitude[100:] = np.nan
    with pytest.raises(ValueError, match="half"):
        half_power(GRID, magnitude, 130.0)
