"""Which instants tell what a sensor buys, and when it buys less than nothing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from flexarm_bringup.ablate import TOO_MUCH, build_page, tip_table
from flexarm_bringup.consistency.ablation import NONE, Track
from flexarm_bringup.consistency.worth import PARTS, is_less, judge_tracks

Array = NDArray[np.float64]
COUNT = 40
TRUTH = {stamp: np.zeros(3) for stamp in range(COUNT)}
FIRST = np.arange(COUNT) < COUNT // 2


def track(sensor: str, off: Array, usable: Array | None = None) -> Track:
    """Return a run whose tip and one mode are off by (COUNT,) [m]."""
    tip = np.zeros((COUNT, 3))
    tip[:, 2] = off
    is_usable = np.ones(COUNT, dtype=bool) if usable is None else usable
    return Track(sensor, tuple(TRUTH), tip, 2 * off, off[:, None], 3 * off[:, None], is_usable)


def everything(off: Array, in_use: Array) -> Track:
    return replace(track(NONE, off), in_use={"gauge": in_use})


def test_what_a_lost_estimate_says_is_no_error_and_no_sigma() -> None:
    """A sigma of three metres stood beside an error of a millimetre."""
    lost = np.where(FIRST, 2e-3, 5.0)
    base, without = judge_tracks([track(NONE, np.full(COUNT, 1e-3)), track("gauge", lost, FIRST)], TRUTH)
    assert (without.tip, without.tip_sigma) == (pytest.approx(2e-3), pytest.approx(4e-3))
    assert without.ratio == pytest.approx(2.0) and without.usable == 0.5
    np.testing.assert_allclose([*without.modes, *without.mode_sigmas], [1e-3, 6e-3])
    assert base.ratio == 1.0 and np.isnan(base.in_use)


def test_of_a_run_that_is_never_usable_or_never_settles_there_is_no_figure() -> None:
    off, never = np.full(COUNT, 1e-3), np.zeros(COUNT, dtype=bool)
    base, lost = track(NONE, off), track("gauge", off, never)
    for run in (lost, lost.at(never)):
        results = judge_tracks([base, run], TRUTH)
        assert np.isnan([results[1].tip, results[1].ratio, results[1].tip_sigma]).all()
        assert "nan" not in build_page(Path("bag"), results, TRUTH).to_text()
    assert results[1].modes.shape == (1,)


def test_a_sensor_is_compared_where_it_was_in_use() -> None:
    off, worse = np.full(COUNT, 1e-3), np.where(FIRST, 4e-3, 1e-3)
    result = judge_tracks([everything(off, FIRST), track("gauge", worse)], TRUTH)[1]
    assert result.ratio == pytest.approx(4.0) and result.in_use == 0.5


def test_of_a_sensor_that_was_never_in_use_nothing_is_told_and_that_is_said() -> None:
    off = np.full(COUNT, 1e-3)
    results = judge_tracks([everything(off, np.zeros(COUNT, dtype=bool)), track("gauge", off)], TRUTH)
    assert results[1].in_use == 0.0 and np.isnan([results[1].tip, *results[1].modes]).all()
    text = build_page(Path("bag"), results, TRUTH).to_text()
    assert "gauge: it was never in use in this record" in text


@pytest.mark.parametrize(("less", "is_said"), [(0.98, False), (0.5, True), (1.1, False)])
def test_that_a_record_is_better_without_a_sensor_is_said_only_beyond_its_scatter(
    less: float, is_said: bool
) -> None:
    rng = np.random.default_rng(3)
    off = 1e-3 * abs(1 + 0.2 * rng.standard_normal((2, COUNT)))
    results = judge_tracks([track(NONE, off[0]), track("gauge", less * off[1])], TRUTH)
    assert (f"gauge: {TOO_MUCH}" in tip_table(results).notes) == is_said


def test_scatter_is_that_from_one_part_of_the_record_to_the_next() -> None:
    """Errors of neighbouring instants are alike: many of one part weigh no more than the part."""
    one_part = np.repeat([-1.0, *np.zeros(PARTS - 1)], 100)
    assert not is_less(one_part)
    assert is_less(np.repeat(-1.0 - 0.1 * np.arange(PARTS), 100))
    assert not is_less(np.full(PARTS - 1, -1.0))
