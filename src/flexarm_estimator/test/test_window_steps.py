"""Joint steps of a window: made once per model and period, and let go with models that are long past."""

from __future__ import annotations

import gc
import weakref
from typing import Any

import numpy as np
import pytest
from planar_strip import DT, SENSORS, strip_model
from test_isolation import CHANNELS, make_parts

from flexarm_estimator.isolation import window
from flexarm_estimator.isolation.channels import Channels
from flexarm_estimator.isolation.window import StepMaker
from flexarm_estimator.settings import EstimatorConfig


class Model:
    """Stands for the parts of one model."""


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Any, float]]:
    calls: list[tuple[Any, float]] = []

    def make(parts: Any, dt: float, most: float, share: float) -> str:
        calls.append((id(parts), dt))
        return f"{id(parts)} {dt:g} {share:g}"

    monkeypatch.setattr(window, "_make", make)
    return calls


def test_a_step_is_made_once_per_model_and_period(made: list[Any]) -> None:
    maker, model = StepMaker(0.005), Model()
    for _ in range(3):
        assert maker.step(model, 0.01) == maker.step(model, 0.0101)  # type: ignore[arg-type]
    maker.step(model, 0.015)  # type: ignore[arg-type]
    assert [dt for _, dt in made] == pytest.approx([0.01, 0.015])


def test_models_that_are_long_past_are_let_go(made: list[Any]) -> None:
    maker, alive = StepMaker(0.005), []
    for _ in range(100):
        model = Model()
        alive.append(weakref.ref(model))
        for periods in (1, 2, 3):
            maker.step(model, 0.005 * periods)  # type: ignore[arg-type]
    del model
    gc.collect()
    assert [ref() is not None for ref in alive] == [False] * 92 + [True] * 8


def test_gauges_that_a_filter_takes_for_worth_less_are_judged_as_what_they_are() -> None:
    noise = {}
    most = Channels(SENSORS, CHANNELS.spans, {"strain_gauge": 8e-6}).most
    for error in (0.0, 8e-6, 1e-4):
        config = EstimatorConfig(strain_error=error, acceleration_error=error * 1e4)
        noise[error] = StepMaker(1e-5, most).step(make_parts(config, strip_model()), DT).noise
    np.testing.assert_allclose(noise[1e-4][:2, :2], noise[8e-6][:2, :2], rtol=1e-12, atol=1e-20)
    np.testing.assert_allclose(noise[8e-6][1, 1] - noise[0.0][1, 1], 8e-6**2, rtol=1e-6)
    assert noise[1e-4][2, 2] > noise[8e-6][2, 2] + 0.9


def test_a_share_of_the_process_noise_leaves_that_of_the_sensors() -> None:
    """Of variances that are linear in it: state, accelerometer, and what they share."""
    parts, maker = make_parts(EstimatorConfig(), strip_model()), StepMaker(1e-5)
    all_of_it, half, none = (maker.counting(share).step(parts, DT).noise for share in (1.0, 0.5, 0.0))
    np.testing.assert_allclose(half, (all_of_it + none) / 2.0, rtol=1e-9, atol=1e-18)
    m = len(CHANNELS.sigma)
    np.testing.assert_allclose(none[:m, :m], np.diag(CHANNELS.sigma**2), rtol=1e-9, atol=1e-18)
    assert not none[m:, m:].any()
    assert maker.counting(1.0) is maker
    assert maker.counting(0.5) is maker.counting(0.5)
