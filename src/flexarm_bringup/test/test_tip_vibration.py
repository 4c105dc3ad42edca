"""The residual of a vibration whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest

from flexarm_bringup.tip_vibration import Watch, read_residual, tip_acceleration

RATE = 500.0
WATCH = Watch(0.1, 2.1, 40.0, 0.5e-3)
T = np.arange(0.0, 3.5, 1 / RATE)


def decay(amplitude: float, hz: float, rate: float, direction: np.ndarray) -> np.ndarray:
    after = np.maximum(T - 1.0, 0.0)
    return np.outer(amplitude * np.exp(-rate * after) * np.sin(2 * np.pi * hz * after), direction)


def test_a_steady_vibration_has_the_rms_of_a_sine_in_any_direction() -> None:
    direction = np.array([2.0, -1.0, 2.0]) / 3.0
    found = read_residual(T, decay(1e-3, 5.0, 0.0, direction) + 0.7, 0.0, 1.0, WATCH)
    assert found.distance == pytest.approx(1e-3 / np.sqrt(2), rel=1e-3)
    # second differences of a 5 Hz sine at 500 Hz are (pi f / rate)^2 / 3 = 0.03 % low
    assert found.acceleration == pytest.approx((2 * np.pi * 5.0) ** 2 * 1e-3 / np.sqrt(2), rel=2e-3)
    assert found.growth == pytest.approx(1.0, abs=0.01)
    assert found.settling > 2.0  # outside until the last crest of the window


def test_settling_is_when_the_envelope_falls_below_the_tolerance() -> None:
    rate = 4.0
    found = read_residual(T, decay(5e-3, 10.0, rate, np.array([0.0, 0.0, 1.0])), 0.0, 1.0, WATCH)
    exact = np.log(5e-3 / 0.5e-3) / rate
    assert exact - 0.05 <= found.settling <= exact  # the last crest above it is within half a period before
    assert found.growth == pytest.approx(np.exp(-rate * 1.0), rel=0.05)


def test_a_move_within_the_tolerance_is_settled_since_its_begin_whatever_was_before() -> None:
    tip = np.outer(np.where(T < 0.3, 1.0, 2e-4 * np.clip((T - 0.6) / 0.4, 0.0, 1.0)), [1.0, 0.0, 0.0])
    assert read_residual(T, tip, 0.6, 1.0, WATCH).settling == pytest.approx(-0.4)


def test_where_it_settles_does_not_count() -> None:
    tip = decay(1e-3, 5.0, 2.0, np.array([1.0, 0.0, 0.0]))
    sagged = tip + np.array([0.1, -0.2, 0.3])
    assert read_residual(T, sagged, 0.0, 1.0, WATCH).distance == pytest.approx(
        read_residual(T, tip, 0.0, 1.0, WATCH).distance, rel=1e-9
    )


def test_what_is_faster_than_the_cutoff_is_not_counted() -> None:
    slow, fast = (decay(1e-3, hz, 0.0, np.array([1.0, 0.0, 0.0])) for hz in (5.0, 160.0))
    inside = (T > 1.2) & (T < 3.0)
    along = (tip_acceleration(tip, RATE, 40.0)[inside, 0] for tip in (slow, fast))
    kept, lost = (np.sqrt(np.mean(a**2)) for a in along)
    assert kept == pytest.approx((2 * np.pi * 5.0) ** 2 * 1e-3 / np.sqrt(2), rel=2e-3)
    # twice a 4th-order filter two octaves above its edge: 48 dB per octave at least
    assert lost < (2 * np.pi * 160.0) ** 2 * 1e-3 * 10 ** (-80 / 20)


@pytest.mark.parametrize("t_end", [1.0, 1.001])  # the motion ends at a tick, or between two
def test_a_window_may_reach_to_the_end_of_a_run_whose_last_tick_is_a_period_before(t_end: float) -> None:
    k = round((t_end + WATCH.end) * RATE)  # ticks of a run of that duration
    found = read_residual(T[:k], decay(1e-3, 5.0, 0.0, np.array([1.0, 0.0, 0.0]))[:k], 0.0, t_end, WATCH)
    assert found.distance == pytest.approx(1e-3 / np.sqrt(2), rel=2e-3)
    with pytest.raises(ValueError, match="ends at"):
        read_residual(T[: k - 1], np.zeros((k - 1, 3)), 0.0, t_end + 0.5 / RATE, WATCH)


def test_a_record_that_ends_early_is_refused() -> None:
    with pytest.raises(ValueError, match="ends at"):
        read_residual(T[:1000], np.zeros((1000, 3)), 0.0, 1.0, WATCH)
