"""Joint steps of a window: made once per model and period, and let go with models that are long past."""

from __future__ import annotations

import gc
import weakref
from typing import Any

import pytest

from flexarm_estimator.isolation import window
from flexarm_estimator.isolation.window import StepMaker


class Model:
    """Stands for the parts of one model."""


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Any, float]]:
    calls: list[tuple[Any, float]] = []

    def make(parts: Any, dt: float) -> str:
        calls.append((id(parts), dt))
        return f"{id(parts)} {dt:g}"

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
