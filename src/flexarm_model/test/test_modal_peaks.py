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
from flexarm_model.modal.half_power import HalfPower, LinesTooCoarseError, half_power
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


def readings(lines: float, interpolate: bool) -> list[HalfPower | None]:
    """Return half power of one mode of 1 % damping, 101 places between two lines; None where refused."""
    step = 2 * 0.01 * 20.0 / lines
    found: list[HalfPower | None] = []
    for place in np.linspace(0.0, 1.0, 101, endpoint=False):
        f = 20.0 + step * (np.arange(-20, 21) - place)
        try:
            found.append(half_power(f, one_mode(f, 20.0, 0.01), 20.0, interpolate))
        except LinesTooCoarseError:
            found.append(None)
    return found


@pytest.mark.parametrize("lines", [0.5, 0.7, 0.8, 0.9, 1.0, 1.2, 1.5, 2.0, 3.0])
def test_half_power_between_lines_is_within_a_quarter_of_the_squared_gap_or_refused(lines: float) -> None:
    """The chord under the resonance falls to half power by (2 / lines)^2 / 16 too late, at most."""
    found = readings(lines, True)
    told = [one for one in found if one]
    assert len(told) == len(found) or lines < 1.0
    assert all(one.low_hz < one.f_hz < one.high_hz for one in told)
    off = np.array([one.zeta / 0.01 - 1 for one in told])
    assert (abs(off) <= min(1 / (4 * lines**2), 0.17) + 0.01).all()  # a resonance leans by its damping ratio


@pytest.mark.parametrize("lines", [0.5, 1.0, 1.5, 2.0, 2.95, 4.0, 5.0, 6.0, 7.0])
def test_half_power_on_lines_is_within_what_its_page_says_or_refused(lines: float) -> None:
    told = [one for one in readings(lines, False) if one]
    assert bool(told) == (lines >= 2.95)
    low, high = (-0.19, 0.37) if lines < 5.0 else (-0.14, 0.21)
    off = np.array([one.zeta / 0.01 - 1 for one in told])
    assert ((low - 0.005 <= off) & (off <= high + 0.005)).all()


@pytest.mark.parametrize(
    ("zeta", "percent"), [(0.01, 0.01), (0.05, 0.25), (0.1, 1.04), (0.2, 4.67), (0.3, 13.73)]
)
def test_half_power_reads_too_much_of_a_damped_mode_by_what_its_page_says(
    zeta: float, percent: float
) -> None:
    """However fine the lines are: a resonance is no symmetric curve over the frequency."""
    f_0, step = 20.0, 0.004
    f = np.arange(1.0, 40.0, step)
    magnitude = one_mode(f, f_0, zeta)
    on_lines, between = (half_power(f, magnitude, f_0, interpolate) for interpolate in (False, True))
    chords = (step / (2 * zeta * f_0)) ** 2 / 4
    exact = np.sqrt((2 - 2 * zeta**2) / (1 - 2 * zeta**2 + np.sqrt(1 - 8 * zeta**2 + 8 * zeta**4)))
    assert between.zeta / zeta == pytest.approx(exact, rel=chords + 1e-7)
    assert 100 * (between.zeta / zeta - 1) == pytest.approx(percent, abs=0.005)
    last = 6 * zeta**4  # what the next terms of the series are, with some room
    assert between.zeta / zeta == pytest.approx(1 + zeta**2, abs=last + chords)
    assert between.stiffness / (2 * np.pi * f_0) ** 2 == pytest.approx(1 - 1.5 * zeta**2, abs=last + chords)
    nearest = step / (2 * zeta * f_0)  # half a line on either side
    assert on_lines.zeta / zeta == pytest.approx(1 + 2 * zeta**2, abs=2 * last + nearest)


def test_half_power_is_refused_where_the_curve_does_not_fall_to_it_below_the_peak() -> None:
    f = np.arange(1e-3, 40.0, 0.004)
    half_power(f, one_mode(f, 20.0, 0.382), 20.0)
    with pytest.raises(ValueError, match="does not fall to half power"):
        half_power(f, one_mode(f, 20.0, 0.383), 20.0)


def test_a_single_mode_on_the_grid_of_seed_000_reads_no_band_that_its_peak_is_outside_of() -> None:
    """13.88 Hz read 64 % too little damping, from a band of 13.72 to 13.82 Hz."""
    f = 0.3125 * np.arange(1.0, 801.0)
    for f_0 in (1.4041, 13.6052, 13.8773, 14.5651):  # at most 0.94 lines per bandwidth
        with pytest.raises(LinesTooCoarseError, match=r"reads 0\.\d+ lines; needed are 1 or more"):
            half_power(f, one_mode(f, f_0, 0.01), f_0)


def test_the_widest_gap_counts_where_lines_are_left_out() -> None:
    f = np.arange(10.0, 30.0, 0.1)
    whole, holed = f, np.delete(f, range(96, 106))  # 19.6 to 20.5 Hz
    assert half_power(whole, one_mode(whole, 20.05, 0.02), 20.0).zeta == pytest.approx(0.02, rel=0.01)
    with pytest.raises(LinesTooCoarseError):
        half_power(holed, one_mode(holed, 20.05, 0.02), 20.0)


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


def test_a_line_beside_the_peak_that_is_no_number_gives_no_band() -> None:
    magnitude = one_mode(GRID, 129.0, 0.02)
    magnitude[130] = np.nan
    with pytest.raises(ValueError, match="does not fall to half power before 131.0 Hz"):
        half_power(GRID, magnitude, 128.0)
