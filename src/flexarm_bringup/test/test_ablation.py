"""What a sensor buys: judged on tracks whose errors are known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flexarm_bringup.ablate import build_page, draw
from flexarm_bringup.consistency.ablation import NONE, Track, judge_tracks

STAMPS = (0, 10, 20, 30)


def track(sensor: str, off: float, stamps: tuple[int, ...] = STAMPS) -> Track:
    k = len(stamps)
    tip = np.zeros((k, 3))
    tip[:, 1] = off
    return Track(
        sensor, stamps, tip, np.full(k, 2e-3), np.full((k, 2), off), np.full((k, 2), 1e-3), np.ones(k)
    )


def test_errors_are_against_the_truth_where_there_is_one() -> None:
    truth = {stamp: np.array([0.0, 1e-3, 0.0]) for stamp in STAMPS}
    base, without = judge_tracks([track(NONE, 0.0), track("gauge", -2e-3)], truth)
    assert base.tip == pytest.approx(1e-3)
    assert without.tip == pytest.approx(3e-3)
    np.testing.assert_allclose(without.modes, 2e-3)


def test_without_a_truth_errors_are_against_all_sensors() -> None:
    base, without = judge_tracks([track(NONE, 1e-3), track("gauge", -2e-3)], {})
    assert base.tip == 0.0
    assert without.tip == pytest.approx(3e-3)


def test_only_instants_that_both_have_are_compared() -> None:
    truth = {10: np.zeros(3), 40: np.full(3, 9.0)}
    _, without = judge_tracks([track(NONE, 0.0), track("gauge", 4e-3, (10, 20, 50))], truth)
    assert without.tip == pytest.approx(4e-3)


def test_page_says_what_is_bought_and_against_what() -> None:
    truth = {stamp: np.array([0.0, 1e-3, 0.0]) for stamp in STAMPS}
    results = judge_tracks([track(NONE, 0.0), track("gauge", -2e-3)], truth)
    page = build_page(Path("bag"), results, truth, [draw(results, truth)])
    text = page.to_text()
    assert "3000.0" in text
    assert "3.00" in text
    assert "gauge" in page.to_html()
    assert "the bag has no truth" in build_page(Path("bag"), results, {}).to_text()
