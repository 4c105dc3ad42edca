"""Verdicts on figures: levels at their thresholds, the worst one speaks, and loops that are late say so."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flexarm_model.ros.loop_health import LoopHealth, quantile
from flexarm_model.settings.diagnosis import DiagnosticsConfig, Figure, Level, judge

PERIOD = 0.005
CONFIG = DiagnosticsConfig()


def loop(beats: list[float], period: float | None = PERIOD) -> LoopHealth:
    health = LoopHealth("node: loop", period, CONFIG)
    for t in beats:
        health.beat(t)
    return health


def regular(n: int = 200, period: float = PERIOD) -> list[float]:
    return [period * k for k in range(n + 1)]


@pytest.mark.parametrize(
    ("value", "level"), [(1.0, Level.OK), (1.5, Level.WARN), (4.5, Level.ERROR), (math.nan, Level.OK)]
)
def test_more_than_the_thresholds_is_bad(value: float, level: Level) -> None:
    assert Figure("jitter [ms]", value, warn=1.0, error=4.0).level == level


@pytest.mark.parametrize(("value", "level"), [(200, Level.OK), (195, Level.WARN), (100, Level.ERROR)])
def test_of_some_figures_less_than_the_thresholds_is_bad(value: float, level: Level) -> None:
    assert Figure("rate [Hz]", value, warn=196.0, error=184.0, is_low_bad=True).level == level


@pytest.mark.parametrize("settings", [{"error_factor": 1.0}, {"rate_shortfall": 0.0}])
def test_a_rate_that_warns_where_it_errs_is_judged_from_below(settings: dict[str, float]) -> None:
    """The sense was told from the order of the thresholds: a sound loop was an error, a slow one was well."""
    for rate, level in ((1.001 / PERIOD, Level.OK), (0.5 / PERIOD, Level.ERROR)):
        health = LoopHealth("node: loop", PERIOD, DiagnosticsConfig(**settings))
        for t in regular(period=1.0 / rate):
            health.beat(t)
        verdict = health.verdict()
        assert verdict.level == level
        assert level == Level.OK or "below" in verdict.text


def test_the_worst_figure_speaks_and_all_are_told() -> None:
    figures = [Figure("a [1]", 2.0, 1.0, 4.0), Figure("b [s]", 9.0, 1.0, 4.0), Figure("c [1]", 0.5)]
    verdict = judge("node: it", figures)
    assert (verdict.level, verdict.text) == (Level.ERROR, "b [s] 9 above 4")
    assert verdict.values == {"a [1]": "2", "b [s]": "9", "c [1]": "0.5"}


def test_what_is_known_already_is_not_drowned_by_a_lesser_figure() -> None:
    verdict = judge("guard", [Figure("a", 2.0, 1.0)], Level.ERROR, "stopped")
    assert (verdict.level, verdict.text) == (Level.ERROR, "stopped")


def test_a_regular_loop_is_well_and_its_rate_is_exact() -> None:
    verdict = loop(regular()).verdict()
    assert verdict.level == Level.OK
    assert float(verdict.values["rate [Hz]"]) == pytest.approx(200.0, rel=1e-5)
    assert float(verdict.values["jitter [ms]"]) < 1e-9


def test_jitter_is_the_standard_deviation_of_the_period() -> None:
    gaps = np.random.default_rng(3).normal(PERIOD, 0.4 * PERIOD, 400).clip(1e-4)
    verdict = loop([0.0, *np.cumsum(gaps)], PERIOD).verdict()
    assert float(verdict.values["jitter [ms]"]) == pytest.approx(1e3 * gaps.std(), rel=1e-4)
    assert verdict.level == Level.WARN and verdict.text.startswith("jitter")
    assert float(verdict.values["period, 99th percentile [ms]"]) == pytest.approx(
        1e3 * np.quantile(gaps, 0.99, method="inverted_cdf"), rel=1e-4
    )


def test_a_slow_loop_is_an_error_and_a_silent_one_is_stale() -> None:
    slow = loop(regular(100, 2 * PERIOD)).verdict()
    assert slow.level == Level.ERROR and slow.text.startswith("rate [Hz] 100 below")
    assert loop([1.0]).verdict().level == Level.STALE


def test_counters_and_times_are_of_the_time_since_the_last_verdict() -> None:
    health = loop(regular())
    health.count("missed cycles", 50)
    health.spend("solve time", 0.002)
    assert health.verdict().level == Level.ERROR  # 50 of 200
    for t in regular():
        health.beat(2.0 + t)
    health.count("missed cycles", 51)
    calm = health.verdict()
    assert calm.values["missed cycles"] == "1" and "solve time [ms]" not in calm.values


def test_solve_times_near_the_period_warn_and_without_a_period_nothing_is_judged() -> None:
    health, lockstep = loop(regular()), loop(regular(100, 7 * PERIOD), None)
    for each in (health, lockstep):
        each.spend("solve time", 0.9 * PERIOD)
    assert health.verdict().text.startswith("solve time [ms] 4.5 above 3")
    assert lockstep.verdict().level == Level.OK


def test_the_quantile_is_that_of_the_inverted_distribution() -> None:
    values = sorted(np.random.default_rng(1).random(57).tolist())
    for share in (0.01, 0.5, 0.99, 1.0):
        assert quantile(values, share) == np.quantile(values, share, method="inverted_cdf")
